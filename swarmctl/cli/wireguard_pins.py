"""The pinned WireGuard keys of the hosts: in NAME.wireguard beside the spec, those of a lab in its folder."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swarmctl.cli import console, file_writes, options
from swarmctl.spec import wireguard_keys

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.remote.transport import HostError
    from swarmctl.swarm.resolved import Swarm


@dataclass(frozen=True)
class Pins:
    """What came of pinning: the hosts whose key differs from the pinned one, and the errors of others."""

    changed: tuple[str, ...]
    failed: dict[str, HostError]


def pin(
    spec: SpecFiles,
    swarm: Swarm,
    hosts: Collection[str],
    replaceable: Collection[str],
    *,
    lab: bool,
    lab_name: str,
) -> Pins:
    """Fetches the keys of ``hosts`` over SSH and pins the new ones, and changed ones of ``replaceable``."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy.public_keys import public_keys
    from swarmctl.lab.paths import lab_paths
    from swarmctl.remote.transport import HostError
    from swarmctl.yamltext import hostlist

    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    found = public_keys(swarm.name, [targets[one] for one in hosts], transport())
    keys = {host: key for host, key in found.items() if not isinstance(key, HostError)}
    path = spec.first.parent / wireguard_keys.path(swarm.name)
    if options.in_lab(lab, lab_name):
        path = lab_paths(lab_name or swarm.name).wireguard_keys
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        content = b""
    except OSError as error:
        console.fail(f"{path} cannot be read: {error.strerror}", "what cannot be read is not replaced")
    known = wireguard_keys.parse(content)
    changed = [host for host, key in keys.items() if known.get(host, key) != key and host not in replaceable]
    fresh = {host: key for host, key in keys.items() if known.get(host) != key and host not in changed}
    if fresh:
        file_writes.replace(path, wireguard_keys.pinned(content, fresh))
        console.out().print(f"pinned the WireGuard keys of {hostlist.written(fresh)} in {path}")
    return Pins(tuple(changed), {host: one for host, one in found.items() if isinstance(one, HostError)})
