"""What ``rekey`` and ``expel`` share: a sealed swarm, its pinned keys, and the way to its hosts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import typer

from swarmctl.cli import console, exit_codes, pin_file
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.cli.pin_file import PinFile
    from swarmctl.deploy.rekey import Exchange
    from swarmctl.remote.transport import HostError
    from swarmctl.swarm.resolved import Swarm


def reached(where: Where) -> tuple[Swarm, PinFile, Exchange]:
    """Returns the swarm, its pinned keys, and what exchanges keys with its hosts; exits without keys."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy.public_keys import exchanged

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
