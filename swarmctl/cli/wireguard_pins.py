"""Pins the WireGuard keys of hosts: the first of each, and with ``--replace`` another one."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from swarmctl.cli import console, pin_file
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.remote.transport import HostError
    from swarmctl.swarm.resolved import Swarm


@dataclass(frozen=True)
class Pins:
    """What came of pinning: the hosts whose key differs from the pinned one, and the errors of others."""

    changed: tuple[str, ...]
    failed: dict[str, HostError]


def pin(where: Where, swarm: Swarm, hosts: Collection[str], replaceable: Collection[str]) -> Pins:
    """Fetches the keys of ``hosts`` over SSH and pins the new ones, and changed ones of ``replaceable``.

    A key that another one takes the place of is retired. Expelled hosts are left out unless replaceable.
    """
    from swarm_onboard.agent.verbs.wireguard_key import Request
    from swarm_onboard.tunnel.keys import line

    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy.rekey import exchanged
    from swarmctl.remote.transport import HostError, Kind
    from swarmctl.yamltext import hostlist

    pins = pin_file.read(where.spec, swarm.name, where.lab_of(swarm.name))
    targets = where.targets(swarm)
    before = pins.keys
    wanted = {
        host: replace(targets[host], expelled=targets[host].expelled and host not in replaceable)
        for host in hosts
        if host in before.live or host not in before.retired or host in replaceable
    }
    found = exchanged(dict.fromkeys(wanted, Request(swarm.name)), wanted, transport())
    keys = {host: one.public for host, one in found.items() if not isinstance(one, HostError)}
    failed = {host: one for host, one in found.items() if isinstance(one, HostError)}
    changed, fresh, lines = [], [], ""
    for host, key in keys.items():
        pinned = before.live.get(host, ())
        if key in before.retired.get(host, ()):
            failed[host] = HostError(
                Kind.REFUSED,
                f"{host}: its WireGuard key is retired for good",
                f"on {host}, remove /etc/swarm/{swarm.name}/wireguard.key; then run the same command again",
            )
        elif pinned and key not in pinned and host not in replaceable:
            changed.append(host)
        elif key not in pinned:
            fresh.append(host)
            lines += line(host, key) + "".join(line(host, old, retired=True) for old in pinned)
    pins.add(lines)
    if fresh:
        console.out().print(f"pinned the WireGuard keys of {hostlist.written(fresh)} in {pins.path}")
    return Pins(tuple(changed), failed)
