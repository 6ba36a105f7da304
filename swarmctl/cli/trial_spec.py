"""The files of a spec in a capsule: all from which its releases can be rendered again, without secrets."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from swarmctl.cli import console
from swarmctl.deploy.secrets import FOLDER as SECRETS
from swarmctl.robot_types.codec_check import codec_beside
from swarmctl.views.escape import printable

if TYPE_CHECKING:
    from swarmctl.spec.load import Document

_SPEC = PurePath("spec")
_PRIVATE_KEY = re.compile(rb"-----BEGIN [A-Z ]*PRIVATE KEY-----")


def write(folder: Path, document: Document, layers: Sequence[Path]) -> list[str]:
    """Writes the files of a spec below ``folder``; of each that cannot be there is a warning instead.

    Returns the places of ``layers``: of the spec, then of its overlays. Raises ``OSError``.
    """
    places = text_places(layers, document.texts)
    for name, place in places.items():
        content = document.texts[name].encode()
        if refusal := _refusal(os.path.relpath(place, _SPEC), content):
            console.show(f"warning: the capsule is without {printable(name)}: {refusal}", error=True)
            content = f"# not in the capsule: {refusal}\n".encode()
        _write(folder / place, content, may_execute=False)
    for path, (content, may) in sorted(beside(document, layers[0]).items()):
        if refusal := _refusal(path, content):
            console.show(f"warning: the capsule is without {printable(path)}: {refusal}", error=True)
        else:
            _write(folder / _SPEC / path, content, may_execute=may)
    return [places[name] for name in dict.fromkeys(map(str, layers))]


def text_places(layers: Sequence[Path], names: Iterable[str]) -> dict[str, str]:
    """Returns the place in a capsule of each text of a spec, by its name.

    What lies in the folder of the spec keeps its path from there. An overlay from elsewhere is beside the
    spec; with files that it includes, in a folder of its own.
    """
    base = _absolute(layers[0]).parent
    own = dict.fromkeys(map(str, layers))
    included = [path for name in names if not (path := _absolute(name)).is_relative_to(base)]
    included = [path for path in included if path not in set(map(_absolute, own))]
    homes: dict[PurePath, PurePath] = {}
    places: dict[str, str] = {}
    for name in dict.fromkeys((*own, *names)):
        path, number = _absolute(name), len(places)
        if path.is_relative_to(base):
            places[name] = str(_SPEC / path.relative_to(base))
            continue
        if name in own and any(one.is_relative_to(path.parent) for one in included):
            homes.setdefault(path.parent, _SPEC / str(number))
        home = max(
            (one for one in homes if path.is_relative_to(one)), key=lambda one: len(one.parts), default=None
        )
        place = homes[home] / path.relative_to(home) if home else _SPEC / f"{number}-{path.name}"
        places[name] = str(place)
    return places


def beside(document: Document, spec: Path) -> Mapping[str, tuple[bytes, bool]]:
    """Returns what is read beside a spec and is no text of it, by the path from its folder.

    Each has its content, and whether it may be executed.
    """
    return dict(_beside(document, _absolute(spec).parent))


def _beside(document: Document, base: PurePath) -> Iterator[tuple[str, tuple[bytes, bool]]]:
    for path, content in document.files.content.items():
        yield path, (content, False)
    for name, content in document.catalog.codecs.items():
        codec = codec_beside(Path(document.catalog.sources[name].path))
        yield str(_absolute(codec).relative_to(base)), (content, False)
    for package in document.packages.delivered.values():
        for path, file in package.files.items():
            yield os.path.normpath(f"{package.folder}/{path}"), file


def _refusal(path: str, content: bytes) -> str:
    """Why a file cannot be in a capsule; empty if it can."""
    if not path.isprintable():
        return "its name is not printable"
    return "a secret" if PurePath(path).parts[0] == SECRETS or _PRIVATE_KEY.search(content) else ""


def _absolute(name: str | Path) -> PurePath:
    """The path as it is spelt: what a link leads to has another name in the spec."""
    return PurePath(os.path.abspath(name))  # noqa: PTH100


def _write(file: Path, content: bytes, *, may_execute: bool) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(content)
    if may_execute:
        file.chmod(file.stat().st_mode | 0o100)
