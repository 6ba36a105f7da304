"""The shortest path of a command from its commander to the robot's wheels, or why there is none. Pure.

Hosts that share a network talk directly, so the shortest path between two nodes has one network at most. A
master carries no commands: it is on the path because both ends find each other through it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.links.ip_link import IpLink
from swarmctl.render.middleware import middleware_of
from swarmctl.swarm.index import SwarmIndex


@dataclass(frozen=True)
class Hop:
    """One part of a path: program, host, network, master, bridge, adapter, line or robot."""

    kind: str
    name: str
    detail: str = ""


@dataclass(frozen=True)
class CommandPath:
    """The hops from a commander to a robot; without hops, ``why`` there is no path."""

    by: str
    robot: str
    hops: tuple[Hop, ...] = ()
    why: str = ""

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "from": self.by,
            "to": self.robot,
            "hops": [{"kind": one.kind, "name": one.name, "detail": one.detail} for one in self.hops],
            "why_not": self.why or None,
        }


def command_paths(index: SwarmIndex) -> tuple[CommandPath, ...]:
    """Returns the path of every command that `control` allows, in the order of the spec."""
    pairs = dict.fromkeys((control.by, robot) for control in index.spec.control for robot in control.of)
    return tuple(_path(index, by, robot) for by, robot in pairs)


def command_path(index: SwarmIndex, by: str, robot: str) -> CommandPath:
    """Returns the path from a commander (program, host or robot) to a robot. The spec must have both."""
    if not any(control.by == by and robot in control.of for control in index.spec.control):
        return CommandPath(by, robot, why=f"`control` does not let `{by}` command `{robot}`")
    return _path(index, by, robot)


def _path(index: SwarmIndex, by: str, robot: str) -> CommandPath:
    origin, to = index.commander_host(by), index.driving[robot]
    if origin is None or to is None:
        return CommandPath(by, robot, why=f"`{by if origin is None else robot}` has no host")
    why = _why_not(index, origin, to)
    return CommandPath(by, robot, () if why else tuple(_hops(index, by, origin, to, robot)), why)


def _why_not(index: SwarmIndex, origin: str, to: str) -> str:
    """The first reason why two hosts cannot talk; empty if they can."""
    for host in (origin, to):
        if host not in index.home:
            return f"host `{host}` runs no ROS in mode {index.spec.mode.value}"
    first, second = index.home[origin].hub, index.home[to].hub
    pairs = [(origin, first), (first, second), (second, to), (origin, to)]
    apart = next((pair for pair in pairs if not index.meet(*pair)), None)
    return f"no network joins `{apart[0]}` and `{apart[1]}`" if apart else ""


def _hops(index: SwarmIndex, by: str, origin: str, to: str, robot: str) -> Iterator[Hop]:
    if by in index.spec.programs:
        yield Hop("program", by)
    yield Hop("host", origin)
    first, second = index.home[origin], index.home[to]
    if origin != to:
        yield Hop("network", index.network_at[index.shared_networks(origin, to)[0]].name)
    if first is second and middleware_of(first.distro).master_mb:
        yield Hop("master", first.name, f"on {first.hub}")
    elif first is not second:
        yield Hop("bridge", f"{first.name} to {second.name}", f"between {first.hub} and {second.hub}")
    if origin != to:
        yield Hop("host", to)
    link = index.line_of(robot)
    if link is not None and (adapter := index.adapter_of(link)) is not None:
        yield Hop("adapter", f"{link.host}/{adapter}")
    if isinstance(link, IpLink) and (network := index.ends_of(link).network) is not None:
        yield Hop("network", network.name)
    if link is not None:
        yield Hop("line", robot, link.line_kind)
    yield Hop("robot", robot, index.spec.robots[robot].type)
