"""``swarmctl render``: writes the release of each host to a folder. Connects to no host."""

from __future__ import annotations

import json as json_format
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, next_command, options, selected

if TYPE_CHECKING:
    from swarmctl.render.bundle import Bundle
    from swarmctl.swarm.resolved import Swarm

_UNFINISHED = ".unfinished-"


def render(
    spec: options.Spec,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The folder to write to.")],
    overlays: options.Overlays = None,
    host: options.HostOrLimit = None,
    force: Annotated[bool, typer.Option("--force", help="Write even if DIR contains other files.")] = False,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Write the release of each host to DIR/HOST. DIR is new, empty, or contains an earlier render.

    Without --host, folders of hosts that are no longer in the spec are removed.
    """
    from swarmctl.render.build_bundle import bundles

    swarm = console.read_spec(spec)
    wanted = bundles(swarm)
    named = {name: wanted[name] for name in selected.hosts(swarm.candidates, host)}
    if not force and (foreign := _foreign_path(out)) is not None:
        console.fail(
            f"{foreign} was not written by swarmctl render",
            "choose an empty --out, or use --force to keep it there",
        )
    try:
        _write(out, named)
        if not host:
            _remove_gone(out, wanted)
    except OSError as error:
        console.fail(console.cannot_write(error, out), "choose another --out")
    _report(out, named, swarm, details=details, json=json)
    if not json:
        for name, bundle in named.items():
            if bundle.unbuilt:
                console.err().print(
                    f"note: {name}: {', '.join(bundle.unbuilt)} left out, which `prepare` builds"
                )
        next_command.advise("plan", spec, *next_command.where(limit=host))


def _foreign_path(out: Path) -> Path | None:
    """A path in ``out`` that no render wrote; None if there is none."""
    if not out.exists():
        return None
    if not out.is_dir():
        return out
    return next((one for one in sorted(out.iterdir()) if not _is_ours(one)), None)


def _is_ours(folder: Path) -> bool:
    if folder.name.startswith(_UNFINISHED):
        return True
    from swarmctl.yamltext.files import content

    try:
        manifest = json_format.loads(content(folder / "manifest.json"))
    except (OSError, ValueError):
        return False
    return isinstance(manifest, dict) and manifest.get("host") == folder.name


def _write(out: Path, bundles: Mapping[str, Bundle]) -> None:
    """Write each host's folder to a temporary folder, then replace the old one as a whole."""
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=_UNFINISHED, dir=out) as aside:
        for name, bundle in bundles.items():
            fresh, place = Path(aside) / name, out / name
            fresh.mkdir()  # also of a host on which nothing of the swarm runs
            for file in bundle.files:
                path = fresh / file.path
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(file.content)
                path.chmod(file.mode)
            (fresh / "manifest.json").write_bytes(bundle.manifest_bytes)
            if place.exists():
                place.rename(Path(aside) / f"{name}.old")
            fresh.rename(place)


def _remove_gone(out: Path, wanted: Mapping[str, Bundle]) -> None:
    for one in out.iterdir():
        if one.name not in wanted and one.is_dir() and _is_ours(one):
            shutil.rmtree(one)


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
