"""``swarmctl top``: what each robot's driver and each program costs its host."""

from __future__ import annotations

import dataclasses
import time
from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, options, selected
from swarmctl.cli.where import Where, with_where


@with_where()
def top(
    where: Where,
    selection: options.Selection = None,
    every: Annotated[float, typer.Option(min=0.5, metavar="SECONDS", help="What is averaged over.")] = 2.0,
    json: options.Json = False,
) -> None:
    """Show what each robot's driver and each program costs its host: CPU and memory.

    On a terminal live, until Ctrl-C; elsewhere once.
    """
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.health.host_costs import HostCosts, chosen
    from swarmctl.views import tables as view

    swarm = console.read_spec(where.spec)
    parts = selected.parts(swarm.candidates, selection, "SELECTION")
    reach = where.targets(swarm)
    costs = HostCosts(swarm.name, [reach[name] for name in parts], transport(), every)
    if console.out().is_terminal and not json:
        from rich.live import Live

        with console.until_ctrl_c(), Live(console=console.out(), auto_refresh=False) as live:
            while True:
                live.update(view.cost_table(*chosen(costs.latest(), parts)), refresh=True)
                time.sleep(every)
    costs.wait_for_all()
    units, errors = chosen(costs.latest(), parts)
    if json:
        failed = [{"host": host, **one.to_json()} for host, one in errors.items()]
        console.print_json({"v": 1, "units": [dataclasses.asdict(one) for one in units], "errors": failed})
    else:
        console.out().print(view.cost_table(units, errors))
    unreached = exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK
    reached = any(one.reached for one in errors.values())
    raise typer.Exit(exit_codes.HOSTS_FAILED if reached else unreached)
