"""The hosts that left a spec and still run its release, as this machine's deploys reached them, or as the
hosts of the swarm name them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from swarmctl.cli import console, exit_codes, selected

if TYPE_CHECKING:
    from swarm_onboard.agent.host_list import HostLogin as StoredLogin

    from swarmctl.deploy.host_lists import HostLists, LeftHost
    from swarmctl.remote.known_hosts import KnownHosts
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


Found = tuple[Mapping[str, "LeftHost"], Sequence[str]]  # those with an address, and the names of the others


def chosen(left: Iterable[str], limit: list[str] | None) -> list[str]:
    """Returns those of the hosts that left which --limit selects; exits if it selects none of them."""
    from swarmctl.spec.selection_candidates import Candidates

    return selected.hosts(Candidates(dict.fromkeys(left, ())), limit) if limit else list(left)


def to_contact(
    swarm: Swarm, found: Found, limit: list[str] | None, known: KnownHosts | None, *, yes: bool
) -> dict[str, LeftHost]:
    """Returns the hosts that left the spec and can be reached; exits if there are none.

    One that only the list of another host names needs a key that is pinned for its name (``known``; None in
    a lab), and the operator's word: an answer, or its name in ``limit``.
    """
    left, unknown = found
    names = chosen([*left, *unknown], limit)
    use: dict[str, LeftHost] = {}
    for name in names:
        reason = _unreachable(swarm, left, name, limit or (), known, yes=yes)
        if reason:
            console.err().print(f"warning: host {name} is no longer in the spec, and {reason}")
        else:
            use[name] = left[name]
    if not use:
        console.show("no host has left the spec that this machine knows how to reach")
        raise typer.Exit(exit_codes.ERROR if names else exit_codes.OK)
    for one in use.values():
        if one.named_by:
            console.err().print(f"{one.name} is {one.place}, as the list of {one.named_by} says")
    return use


def _unreachable(
    swarm: Swarm,
    left: Mapping[str, LeftHost],
    name: str,
    limit: Sequence[str],
    known: KnownHosts | None,
    *,
    yes: bool,
) -> str:
    """Why a host is not contacted, with what to do; empty if it is."""
    again = f"add it again and remove it with `--limit {name}`"
    forget = f"if it is gone for good: `--orphans --forget --limit {name}`"
    one = left.get(name)
    if one is None or (one.via is not None and one.via not in left and one.via not in swarm.hosts):
        return f"where it is reached is not known; {again}; {forget}"
    if one.named_by and known is not None:
        named = f"only the list of {one.named_by} says that it is {one.place}"
        if not known.find((name.lower(),)):
            return f"{named}; no key is pinned for its name: {again}, after `swarmctl trust`; {forget}"
        if yes and name not in limit:
            return f"{named}; if that is right, `--limit {name}` removes it from there; {forget}"
    return ""
