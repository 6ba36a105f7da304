"""``swarmctl status``: is the swarm healthy, and if not, why."""

from __future__ import annotations

import json as json_format
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from swarmctl.cli import access, console, exits
from swarmctl.cli.layers import Layers

if TYPE_CHECKING:
    from swarmctl.health.status import Status

Look = Callable[[], "Status"]


def status(
    spec: access.Spec,
    overlays: access.Overlays = None,
    watch: Annotated[bool, typer.Option("--watch", help="Look again and again, until Ctrl-C.")] = False,
    every: Annotated[float, typer.Option(min=1.0, metavar="SECONDS", help="With --watch: how often.")] = 5.0,
    window: Annotated[
        float, typer.Option(min=0.5, max=10.0, metavar="SECONDS", help="How long to listen to each topic.")
    ] = 2.0,
    lab: access.Lab = False,
    lab_name: access.LabName = "",
    limit: access.Limit = None,
    parallel: access.Parallel = 64,
    json: access.Json = False,
) -> None:
    """Ask every host how it and its robots are. Exit code 0 healthy, 5 unhealthy, 4 only hosts away."""
    look = _look(spec, limit, lab=lab, lab_name=lab_name, window=window, parallel=parallel)
    if watch and json:
        _each_round(look, every, lambda seen: print(json_format.dumps(seen.to_json()), flush=True))
    elif watch:
        _watch(look, every)
    seen = _asking(look)
    if json:
        console.print_json(seen.to_json())
    else:
        from swarmctl.views import status as view

        console.out().print(view.status(seen))
    raise typer.Exit(_exit(seen))


def _look(
    spec: Layers, limit: list[str] | None, *, lab: bool, lab_name: str, window: float, parallel: int
) -> Look:
    """One round: ask all hosts, diagnose."""
    from swarmctl.health import status as health
    from swarmctl.health.ask import ask
    from swarmctl.health.diagnose import diagnose
    from swarmctl.health.expected import Release, expected_graph
    from swarmctl.remote.ssh import SshTransport
    from swarmctl.render.host import bundles

    swarm = console.read_spec(spec)
    wanted = bundles(swarm)
    releases = {
        name: Release(wanted[name].digest, tuple(unit.name for unit in wanted[name].units))
        for name in access.chosen(wanted, limit)
        if wanted[name].files
    }
    graph = expected_graph(swarm, releases)
    targets = access.targets(spec, swarm, lab=lab, lab_name=lab_name)
    transport = SshTransport()

    def look() -> Status:
        outcomes = ask(graph, targets, transport, window=window, parallel=parallel)
        return health.status(graph, outcomes, diagnose(graph, outcomes))

    return look


def _asking(look: Look) -> Status:
    """Look, and say meanwhile on a terminal that this takes a moment."""
    if not console.err().is_terminal:
        return look()
    with console.err().status("asking the hosts ..."):
        return look()


def _watch(look: Look, every: float) -> NoReturn:
    """The picture of each round: in place on a terminal, elsewhere one block after the other."""
    from swarmctl.views import status as view

    if not console.out().is_terminal:
        _each_round(look, every, lambda seen: console.out().print(view.status(seen), end="\n\n"))
    from rich.live import Live

    with Live(console=console.out(), auto_refresh=False) as live:
        _each_round(look, every, lambda seen: live.update(view.status(seen), refresh=True))


def _each_round(look: Look, every: float, show: Callable[[Status], None]) -> NoReturn:
    """For ever: look, show, wait for what is left of ``every`` seconds."""
    while True:
        due = time.monotonic() + every
        show(look())
        time.sleep(max(0.0, due - time.monotonic()))


def _exit(seen: Status) -> int:
    if seen.diagnosis.healthy:
        return exits.OK
    return exits.HOSTS_UNREACHABLE if seen.diagnosis.only_unreachable else exits.UNHEALTHY
