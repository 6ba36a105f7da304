"""``swarmctl expel``: no host of a sealed swarm accepts a lost one any more."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import console, deploy_steps, next_command, sealed_hosts, selected
from swarmctl.cli.where import Where, with_where


@with_where()
def expel(
    where: Where,
    host: Annotated[str, typer.Argument(metavar="HOST", help="The host that was lost.", show_default=False)],
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask first.")] = False,
) -> None:
    """Retire the WireGuard keys of a lost host on all others, at once and for good.

    swarmctl does not log in to it any more. Hosts that do not answer are named; the next deploy finishes it
    there.
    """
    from swarmctl.deploy import rekey as keys
    from swarmctl.yamltext import hostlist

    swarm, pins, exchange = sealed_hosts.reached(where)
    lost = selected.one(swarm.candidates, host, "hosts", "HOST")
    if not {lost} & (pins.keys.live.keys() | pins.keys.retired.keys()):
        console.fail(f"{lost} has no pinned WireGuard key: no host accepts it", f"{pins.path} has none")
    if not yes and deploy_steps.asks():
        deploy_steps.agree(f"Expel {lost} from {swarm.name} now?")
    behind = keys.expel(swarm, lost, pins, exchange)
    done = [one for one in keys.members(swarm) if one not in (lost, *behind)]
    without = f"; not accepted any more by {hostlist.written(done)}" if done else ""
    console.out().print(f"{lost} is expelled, in {pins.path}{without}")
    sealed_hosts.show_errors(behind, f"accepts {lost} until the next deploy, or the same command, reaches it")
    next_command.advise("graph", where.spec, "--impact")
    sealed_hosts.end(behind)
