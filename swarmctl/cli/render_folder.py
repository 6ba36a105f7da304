"""The folder that ``swarmctl render`` writes: one folder for each host, and the user's files, which stay."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console
from swarmctl.yamltext.files import content

if TYPE_CHECKING:
    from swarmctl.render.bundle import Bundle

_UNFINISHED = ".unfinished-"


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Create ``out``, and keep other renders waiting until the end. Raises OSError."""
    out.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(out, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def foreign_file(out: Path) -> Path | None:
    """A file in ``out`` that no render wrote; None if there is none."""
    return next((file for one in sorted(out.iterdir()) for file in _foreign(one)), None)


def write(out: Path, bundles: Mapping[str, Bundle]) -> None:
    """Write each host's folder to a temporary folder; then replace the old ones; foreign files stay.

    Ends the program before the first change if a foreign file is in the way. Raises OSError.
    """
    with tempfile.TemporaryDirectory(prefix=_UNFINISHED, dir=out) as aside:
        kept: list[tuple[Path, Path]] = []
        for name, bundle in bundles.items():
            fresh = Path(aside) / name
            _write_one(fresh, bundle)
            moves = [(file, fresh / file.relative_to(out / name)) for file in _foreign(out / name)]
            for file, place in moves:
                if place.exists():
                    console.fail(
                        f"{file} was not written by swarmctl render, which writes this file", "move it"
                    )
            kept += moves
        for file, place in kept:
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(file, place, follow_symlinks=False)
        for name in bundles:
            if (out / name).exists():
                (out / name).rename(Path(aside) / f"{name}.old")
            (Path(aside) / name).rename(out / name)


def remove_gone(out: Path, wanted: Mapping[str, Bundle]) -> None:
    """Remove what earlier renders wrote for hosts that the spec no longer has. Raises OSError."""
    for one in out.iterdir():
        if one.name.startswith(_UNFINISHED):
            shutil.rmtree(one)
        elif one.name not in wanted and (files := _rendered(one)) is not None:
            for file in files:
                file.unlink(missing_ok=True)
            for folder, _, _ in os.walk(one, topdown=False):
                if not os.listdir(folder):  # noqa: PTH208
                    os.rmdir(folder)  # noqa: PTH106


def _write_one(folder: Path, bundle: Bundle) -> None:
    folder.mkdir()  # also of a host on which nothing of the swarm runs
    for file in bundle.files:
        path = folder / file.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(file.content)
        path.chmod(file.mode)
    (folder / "manifest.json").write_bytes(bundle.manifest_bytes)


def _foreign(path: Path) -> list[Path]:
    """The files at or below ``path`` that no render wrote."""
    if path.name.startswith(_UNFINISHED):
        return []
    if not path.is_dir():
        return [path] if path.exists() else []
    rendered = _rendered(path) or set()
    return sorted(one for one in path.rglob("*") if not one.is_dir() and one not in rendered)


def _rendered(folder: Path) -> set[Path] | None:
    """The files that the manifest in ``folder`` lists; None if it is not the folder of a host."""
    try:
        manifest = json.loads(content(folder / "manifest.json"))
    except (OSError, ValueError):
        return None
    if not isinstance(manifest, dict) or manifest.get("host") != folder.name:
        return None
    return {folder / path for path in (*manifest.get("files", ()), "manifest.json")}
