"""``swarmctl render``: writes the release of each host to a folder. Connects to no host."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, file_writes, options, selected
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.render.bundle import Bundle
    from swarmctl.swarm.resolved import Swarm


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
    from swarmctl.yamltext.files import content

    try:
        manifest = json.loads(content(folder / "manifest.json"))
    except (OSError, ValueError):
        return None
    if not isinstance(manifest, dict) or manifest.get("host") != folder.name:
        return None
    return {folder / path for path in (*manifest.get("files", ()), "manifest.json")}


def render(
    spec: options.Spec,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The folder to write to.")],
    overlays: options.Overlays = None,
    host: options.HostOrLimit = None,
    sbom: Annotated[
        Path | None,
        typer.Option(
            "--sbom", metavar="FILE", help="Also write what the releases consist of to FILE: CycloneDX, JSON."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write even if DIR contains other files.")] = False,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Write the release of each host to DIR/HOST. DIR is new, empty, or contains an earlier render.

    Without --host, folders of hosts that are no longer in the spec are removed.
    """
    from swarmctl.render.build_bundle import bundles
    from swarmctl.views.sbom import cyclonedx

    swarm = console.read_spec(spec)
    wanted = bundles(swarm)
    named = {name: wanted[name] for name in selected.hosts(swarm.candidates, host)}
    if out.exists() and not out.is_dir():
        console.fail(f"{out} was not written by swarmctl render", "choose another --out")
    if sbom is not None and sbom.resolve().is_relative_to(out.resolve()):
        console.fail(f"{sbom} is in the folder of the releases, {out}", "choose a FILE beside it")
    try:
        with locked(out):
            if not force and (foreign := foreign_file(out)) is not None:
                console.fail(
                    f"{foreign} was not written by swarmctl render",
                    "choose an empty --out, or use --force to keep it there",
                )
            write(out, named)
            if not host:
                remove_gone(out, wanted)
    except OSError as error:
        console.fail(console.cannot_write(error, out), "choose another --out")
    if sbom is not None:
        file_writes.replace(sbom, cyclonedx(swarm, named).encode())
    _report(out, named, swarm, details=details, json=json)
    if not json:
        for name, bundle in named.items():
            if bundle.unbuilt:
                console.err().print(
                    f"note: {name}: {', '.join(bundle.unbuilt)} left out, which `prepare` builds"
                )
            if bundle.unsigned:
                console.err().print(
                    f"note: {name}: {', '.join(bundle.unsigned)} not signed; `swarmctl keys` signs them"
                )
            if bundle.unpinned:
                console.err().print(
                    f"note: {name}: the WireGuard keys of {', '.join(bundle.unpinned)} are not pinned; "
                    "`swarmctl trust` pins them"
                )
        Where(spec, limit=host).advise("plan")


def _report(out: Path, bundles: Mapping[str, Bundle], swarm: Swarm, *, details: bool, json: bool) -> None:
    """Print a line for each host; one for more than a few with the same robot types and number of files."""
    from swarmctl.views.equal_hosts import FEW, grouped, names_of
    from swarmctl.yamltext import hostlist

    if json:
        hosts = {
            name: {"digest": bundle.digest, "files": len(bundle.files), "path": str(out / name)}
            for name, bundle in bundles.items()
        }
        console.print_json({"v": 1, "hosts": hosts})
        return
    known = names_of(swarm)
    groups = grouped(
        bundles,
        lambda name: (known[name].kind, len(bundles[name].files)),
        alone=lambda group: details or len(group) <= FEW,
    )
    listed = [hostlist.written(group) for group in groups]
    width = max(map(len, listed), default=0)
    for names, group in zip(listed, groups, strict=True):
        release = bundles[group[0]].digest if len(group) == 1 else "one each"
        console.out().print(f"{names:<{width}}  {release:<16}  {len(bundles[group[0]].files)} files")
