"""The hosts that left a spec and still run its release, as this machine's deploys reached them, or as the
hosts of the swarm name them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarm_onboard.agent.host_list import HostLogin as StoredLogin

    from swarmctl.deploy.host_lists import HostLists, LeftHost
    from swarmctl.spec.reach import HostLogin
    from swarmctl.swarm.resolved import Host, Swarm


@dataclass(frozen=True)
class WithLeftHosts:
    """The hosts of a swarm and those that left it: one of them may be the way to another."""

    name: str
    hosts: Mapping[str, HostLogin]


def stored_login(host: Host) -> StoredLogin:
    """Returns how the spec reaches a host, as the journal and the hosts store it."""
    from swarm_onboard.agent.host_list import HostLogin

    return HostLogin(host.address, host.user, host.port, host.via, sorted(host.declared))


def lists_of(swarm: Swarm) -> HostLists:
    """Returns what takes the lists that the hosts of a swarm keep."""
    from swarmctl.deploy.host_lists import HostLists

    return HostLists(swarm.name, {name: stored_login(host) for name, host in swarm.hosts.items()})


def left_hosts(swarm: Swarm, lists: HostLists, *, in_lab: bool) -> tuple[dict[str, LeftHost], list[str]]:
    """Returns the hosts that left, by name, and the names of those whose address is not known.

    The journal of this machine, which has no host of a lab, counts more than the lists of hosts.
    """
    from swarmctl.deploy import journal

    place = journal.folder(swarm.name)
    found: dict[str, LeftHost] = {}
    unknown: list[str] = []
    for name in journal.left(place, swarm.hosts) if not in_lab else ():
        login = journal.login_of(place, name) or lists.left.get(name)
        if login is None:
            unknown.append(name)
        else:
            found[name] = _left(name, login, "" if journal.login_of(place, name) else lists.source(name))
    for name, login in lists.left.items():
        found.setdefault(name, _left(name, login, lists.source(name)))
    return found, unknown


def _left(name: str, login: StoredLogin, named_by: str) -> LeftHost:
    from swarmctl.deploy.host_lists import LeftHost

    declared = frozenset(login.declared)
    return LeftHost(name, login.address, login.user, login.port, login.via, declared, named_by)


def with_left(swarm: Swarm, left: Mapping[str, LeftHost]) -> WithLeftHosts:
    """Returns the hosts of a swarm with those that left it."""
    return WithLeftHosts(swarm.name, {**left, **swarm.hosts})
