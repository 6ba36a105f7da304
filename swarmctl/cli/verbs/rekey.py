"""``swarmctl rekey``: new WireGuard keys for the hosts of a sealed swarm, without an interruption."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, deploy_steps, exit_codes, next_command, pin_file, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.cli.pin_file import PinFile
    from swarmctl.deploy.rekey import Exchange
    from swarmctl.remote.transport import HostError
    from swarmctl.swarm.resolved import Swarm


def reached(where: Where) -> tuple[Swarm, PinFile, Exchange]:
    """Returns the swarm, its pinned keys, and what exchanges keys with its hosts; exits without keys."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy.rekey import exchanged

    swarm = where.swarm(console.read_document(where.spec))
    if not swarm.overlay:
        console.fail(f"{where.spec.first} has no WireGuard keys", "they belong to `security: sealed`")
    pins = pin_file.read(where.spec, swarm.name, where.lab_of(swarm.name))
    targets = where.targets(swarm)
    way = transport()

    return swarm, pins, lambda requests: exchanged(requests, targets, way)


def show_errors(errors: Mapping[str, HostError], result: str) -> None:
    """Prints the error of each host, and what comes of it."""
    from swarmctl.views.escape import printable

    for host, one in errors.items():
        console.show(f"{host}  {one.kind.value}: {printable(one.message)}; it {result}", error=True)
        if one.hint:
            console.show(f"  help: {printable(one.hint)}", error=True)


def end(errors: Mapping[str, HostError]) -> None:
    """Exits with the code of the errors, if there are any."""
    if errors:
        reached = any(one.reached for one in errors.values())
        raise typer.Exit(exit_codes.HOSTS_FAILED if reached else exit_codes.HOSTS_UNREACHABLE)


@with_where("limit")
def rekey(
    where: Where,
) -> None:
    """Give the hosts of a sealed swarm new WireGuard keys; the old ones are worth nothing then.

    A host changes its key once all its peers know the new one. What an interrupted run has left is finished.
    """
    from swarmctl.deploy import rekey as keys
    from swarmctl.yamltext import hostlist

    swarm, pins, exchange = reached(where)
    members = keys.members(swarm)
    chosen = [one for one in selected.hosts(swarm.candidates, where.limit) if one in members]
    done = keys.rekey(swarm, chosen, pins, exchange)
    if done.changed:
        console.out().print(f"{hostlist.written(done.changed)}: a new WireGuard key, pinned in {pins.path}")
    show_errors(done.kept, "keeps its key")
    behind = {host: one for host, one in done.behind.items() if host not in done.kept}
    show_errors(behind, "does not know all keys until the next deploy reaches it")
    where.advise("status")
    end({**done.kept, **done.behind})


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

    swarm, pins, exchange = reached(where)
    lost = selected.one(swarm.candidates, host, "hosts", "HOST")
    if not {lost} & (pins.keys.live.keys() | pins.keys.retired.keys()):
        console.fail(f"{lost} has no pinned WireGuard key: no host accepts it", f"{pins.path} has none")
    if not yes and deploy_steps.asks():
        deploy_steps.agree(f"Expel {lost} from {swarm.name} now?")
    behind = keys.expel(swarm, lost, pins, exchange)
    done = [one for one in keys.members(swarm) if one not in (lost, *behind)]
    without = f"; not accepted any more by {hostlist.written(done)}" if done else ""
    console.out().print(f"{lost} is expelled, in {pins.path}{without}")
    show_errors(behind, f"accepts {lost} until the next deploy, or the same command, reaches it")
    next_command.advise("graph", where.spec, "--impact")
    end(behind)
