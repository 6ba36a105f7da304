"""The five working modes as islands: who shares a ROS graph, who runs its master, who drives which robot."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass

from swarmctl.spec import model
from swarmctl.spec.model import Mode, Spec
from swarmctl.topology.swarm import Island

MULTIMASTER = (Mode.STANDALONE, Mode.COMBINED)  # where several masters meet


@dataclass(frozen=True)
class Role:
    """The host a mode needs by name: the key that names it, and what it does there."""

    key: str
    duty: str


# Which host a mode is built around (paper, section 4).
ROLES = {
    Mode.SINGLE_MINDED: Role("leader", "runs the master and every driver"),
    Mode.LEADER: Role("leader", "runs the master and commands the others"),
    Mode.CENTRAL: Role("hub", "runs the master that all robots connect to"),
}


def hub_of(arrangement: Spec | model.Island) -> str | None:
    """The host that runs the master of a swarm or an island in a one-island mode, if it is named."""
    role = ROLES.get(Mode(arrangement.mode))
    return getattr(arrangement, role.key) if role else None


def driving_host(spec: Spec, robot: str) -> str | None:
    """The host that runs a robot's driver: its own; in mode single-minded always the leader."""
    if spec.mode is Mode.SINGLE_MINDED:
        return spec.leader
    return spec.robots[robot].host


def islands_of(spec: Spec) -> tuple[Island, ...]:
    """The islands of a spec, those left out whose hub is not named. A robot's host alone may run no ROS."""
    match spec.mode:
        case Mode.STANDALONE:
            return tuple(_island(spec, host, host, (host,)) for host in _inside(spec))
        case Mode.COMBINED:
            return tuple(
                _island(spec, name, hub, _members(Mode(island.mode), hub, island.hosts))
                for name, island in spec.islands.items()
                if (hub := hub_of(island)) is not None
            )
        case _:
            hub = hub_of(spec)
            return (
                ()
                if hub is None
                else (_island(spec, spec.name, hub, _members(spec.mode, hub, _inside(spec))),)
            )


def passages(spec: Spec) -> frozenset[str]:
    """The hosts just to jump through: nothing else names them, but for networks that no master is on.

    One that has something for programs is more than that.
    """
    ways = {host.via for host in spec.hosts.values() if host.via is not None}
    if not ways:
        return frozenset()
    ways = {name for name in ways if name not in spec.hosts or not spec.hosts[name].has}
    ways -= {hub_of(spec), spec.time.root, *(robot.host for robot in spec.robots.values())}
    ways -= {*(program.host for program in spec.programs.values()), *(one.by for one in spec.control)}
    ways = ways.difference(*(island.hosts for island in spec.islands.values()))
    masters = _masters(spec, ways)
    networks = (link.hosts for link in spec.links if isinstance(link, model.NetworkLink))
    return frozenset(ways.difference(*(hosts for hosts in networks if not masters.isdisjoint(hosts))))


def _masters(spec: Spec, ways: Set[str]) -> Set[str]:
    """The hosts that run a master beside ``ways``. Islands name all their hosts: nobody joins those."""
    match spec.mode:
        case Mode.STANDALONE:
            return spec.hosts.keys() - ways
        case Mode.COMBINED:
            return set()
        case _:
            return {hub} if (hub := hub_of(spec)) is not None else set()


def _inside(spec: Spec) -> tuple[str, ...]:
    apart = passages(spec)
    return tuple(host for host in spec.hosts if host not in apart)


def _members(mode: Mode, hub: str, hosts: tuple[str, ...]) -> tuple[str, ...]:
    """The hosts that run ROS: in mode single-minded the leader alone."""
    return (hub,) if mode is Mode.SINGLE_MINDED else hosts


def _island(spec: Spec, name: str, hub: str, hosts: tuple[str, ...]) -> Island:
    port = spec.hosts[hub].master_port if hub in spec.hosts else None
    return Island(name=name, hub=hub, hosts=hosts, master_port=port or spec.ros.master_port)
