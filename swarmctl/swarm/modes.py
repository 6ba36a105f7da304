"""The five modes as islands: which hosts share a ROS graph, and which run the master and the drivers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass

from swarmctl.links.link_base import NetworkLink
from swarmctl.spec import model
from swarmctl.spec.model import Mode, Spec
from swarmctl.swarm.discovery import discovery_of, domains, has_master
from swarmctl.swarm.resolved import Island

MULTIMASTER = (Mode.STANDALONE, Mode.COMBINED)  # modes with several masters


@dataclass(frozen=True)
class Role:
    """The host that a mode must name: the key that names it, and what that host does.

    ``without_master``: the same where nodes find each other without a master.
    """

    key: str
    duty: str
    without_master: str


# Which host a mode is built around (paper, section 4).
ROLES = {
    Mode.SINGLE_MINDED: Role("leader", "runs the master and every driver", "runs every driver"),
    Mode.LEADER: Role("leader", "runs the master and commands the others", "commands the others"),
    Mode.CENTRAL: Role("hub", "runs the master that all robots connect to", "all robots find each other by"),
}


def hub_of(arrangement: Spec | model.Island) -> str | None:
    """Returns the host that runs the master of an island, or of the only one; None if not declared."""
    role = ROLES.get(Mode(arrangement.mode))
    return getattr(arrangement, role.key) if role else None


def driving_host(spec: Spec, robot: str) -> str | None:
    """Returns the host that runs a robot's driver: the robot's own; in mode single-minded the leader."""
    if spec.mode is Mode.SINGLE_MINDED:
        return spec.leader
    return spec.robots[robot].host


def islands_of(spec: Spec) -> tuple[Island, ...]:
    """Returns the islands of a spec, without those whose hub is not declared."""
    declared = tuple(_declared(spec))
    without_master = [one.name for one in declared if not has_master(one.distro)]
    numbers = domains(spec.name, spec.ros.domain, len(without_master))
    domain_of = dict(zip(without_master, numbers, strict=False))
    return tuple(_island(spec, one, domain_of.get(one.name, 0)) for one in declared)


def distros_of_hosts(spec: Spec) -> Mapping[str, str]:
    """Returns the ROS distribution of each host: in mode combined that of its island, else that of `ros`."""
    found = dict.fromkeys(spec.hosts, spec.ros.distro)
    for one in reversed(spec.islands.values()) if spec.mode is Mode.COMBINED else ():
        found |= dict.fromkeys(one.hosts, one.distro) if one.distro is not None else {}
    return found


@dataclass(frozen=True)
class _Declared:
    """An island as the spec declares it: ``hosts`` includes those that run no ROS."""

    name: str
    mode: Mode
    hub: str
    hosts: tuple[str, ...]
    distro: str
    security: str


def _declared(spec: Spec) -> Iterator[_Declared]:
    distro = spec.ros.distro
    match spec.mode:
        case Mode.STANDALONE:
            for host in _ros_hosts(spec):
                yield _Declared(host, spec.mode, host, (host,), distro, spec.security)
        case Mode.COMBINED:
            for name, island in spec.islands.items():
                if (hub := hub_of(island)) is not None:
                    own, security = island.distro or distro, island.security or spec.security
                    yield _Declared(name, Mode(island.mode), hub, island.hosts, own, security)
        case _:
            if (hub := hub_of(spec)) is not None:
                yield _Declared(spec.name, spec.mode, hub, _ros_hosts(spec), distro, spec.security)


def jump_hosts(spec: Spec) -> frozenset[str]:
    """Hosts used only as SSH jump hosts: named in `via`, and otherwise only by networks without a master.

    A host with `has` is not one of them: programs may run there.
    """
    found = {host.via for host in spec.hosts.values() if host.via is not None}
    if not found:
        return frozenset()
    found = {name for name in found if name not in spec.hosts or not spec.hosts[name].has}
    found -= {hub_of(spec), spec.time.root, *(robot.host for robot in spec.robots.values())}
    found -= {*(program.host for program in spec.programs.values()), *(one.by for one in spec.control)}
    found = found.difference(*(island.hosts for island in spec.islands.values()))
    masters = _masters(spec, found)
    networks = (link.hosts for link in spec.links if isinstance(link, NetworkLink))
    return frozenset(found.difference(*(hosts for hosts in networks if not masters.isdisjoint(hosts))))


def _masters(spec: Spec, jump_hosts: Set[str]) -> Set[str]:
    """The hosts that run a master, without ``jump_hosts``. Islands list their hosts: no other host joins."""
    match spec.mode:
        case Mode.STANDALONE:
            return spec.hosts.keys() - jump_hosts
        case Mode.COMBINED:
            return set()
        case _:
            return {hub} if (hub := hub_of(spec)) is not None else set()


def _ros_hosts(spec: Spec) -> tuple[str, ...]:
    excluded = jump_hosts(spec)
    return tuple(host for host in spec.hosts if host not in excluded)


def _members(mode: Mode, hub: str, hosts: tuple[str, ...]) -> tuple[str, ...]:
    """The hosts of an island that run ROS: in mode single-minded only the leader."""
    return (hub,) if mode is Mode.SINGLE_MINDED else hosts


def _island(spec: Spec, declared: _Declared, domain: int) -> Island:
    hub, members = declared.hub, _members(declared.mode, declared.hub, declared.hosts)
    port = spec.hosts[hub].master_port if hub in spec.hosts else None
    discovery = discovery_of(spec.ros, spec.mode, hub, members, domain)
    return Island(
        declared.name,
        hub,
        members,
        declared.distro,
        port or spec.ros.master_port,
        discovery,
        security=declared.security,
    )
