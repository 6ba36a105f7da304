"""``swarmctl render``: writes the release of each host to a folder. Connects to no host."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, file_writes, options, selected
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.render.bundle import Bundle
    from swarmctl.swarm.resolved import Swarm


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
    from swarmctl.cli import render_folder
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
        with render_folder.locked(out):
            if not force and (foreign := render_folder.foreign_file(out)) is not None:
                console.fail(
                    f"{foreign} was not written by swarmctl render",
                    "choose an empty --out, or use --force to keep it there",
                )
            render_folder.write(out, named)
            if not host:
                render_folder.remove_gone(out, wanted)
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
