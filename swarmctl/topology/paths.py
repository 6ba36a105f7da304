"""The shortest path of an order from who gives it to the robot's wheels, or why there is none. Pure.

Hosts that share a network talk directly, so the shortest path between two nodes has one network at most. A
master carries no orders: it stands in a path because the two ends find each other through it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.spec.model import Bluetooth, Serial
from swarmctl.topology import modes
from swarmctl.topology.bridges import commanders_host
from swarmctl.topology.lines import line_kind
from swarmctl.topology.wiring import Wiring


@dataclass(frozen=True)
class Hop:
    """One part on the way: program, host, network, master, bridge, line or robot."""

    kind: str
    name: str
    detail: str = ""


@dataclass(frozen=True)
class Way:
    """The hops from a commander to a robot; without hops, ``why`` there is no way."""

    by: str
    robot: str
    hops: tuple[Hop, ...] = ()
    why: str = ""

    def to_json(self) -> dict[str, object]:
        return {
            "from": self.by,
            "to": self.robot,
            "hops": [{"kind": one.kind, "name": one.name, "detail": one.detail} for one in self.hops],
            "why_not": self.why or None,
        }


def ways(wiring: Wiring) -> tuple[Way, ...]:
    """The way of every order that `control` allows, in the order of the spec."""
    pairs = dict.fromkeys((order.by, order.robot) for order in wiring.orders)
    return tuple(_walked(wiring, by, robot) for by, robot in pairs)


def way(wiring: Wiring, by: str, robot: str) -> Way:
    """The way from a program, host or robot that commands to a robot; all names are known to the spec."""
    if not any(order.by == by and order.robot == robot for order in wiring.orders):
        return Way(by, robot, why=f"`control` does not let `{by}` command `{robot}`")
    return _walked(wiring, by, robot)


def _walked(wiring: Wiring, by: str, robot: str) -> Way:
    spec = wiring.spec
    origin, to = commanders_host(spec, by), modes.driving_host(spec, robot)
    if origin is None or to is None:
        return Way(by, robot, why=f"`{by if origin is None else robot}` has no host")
    reason = _why_not(wiring, origin, to)
    hops = () if reason else tuple(_hops(wiring, by, origin, to, robot))
    return Way(by, robot, hops, reason)


def _why_not(wiring: Wiring, origin: str, to: str) -> str:
    """The first thing that keeps two hosts apart; empty if nothing does."""
    for host in (origin, to):
        if host not in wiring.home:
            return f"host `{host}` runs no ROS in mode {wiring.spec.mode.value}"
    first, second = wiring.home[origin], wiring.home[to]
    joints = [(origin, first.hub), (first.hub, second.hub), (second.hub, to), (origin, to)]
    apart = next((pair for pair in joints if pair[0] != pair[1] and not wiring.shared(*pair)), None)
    return f"no network joins `{apart[0]}` and `{apart[1]}`" if apart else ""


def _hops(wiring: Wiring, by: str, origin: str, to: str, robot: str) -> Iterator[Hop]:
    spec = wiring.spec
    if by in spec.programs:
        yield Hop("program", by)
    yield Hop("host", origin)
    first, second = wiring.home[origin], wiring.home[to]
    if origin != to:
        yield Hop("network", wiring.shared(origin, to)[0])
    if first is second:
        yield Hop("master", first.name, f"on {first.hub}")
    else:
        yield Hop("bridge", f"{first.name} to {second.name}", f"between {first.hub} and {second.hub}")
    if origin != to:
        yield Hop("host", to)
    yield from _last_hops(wiring.lines.get(robot), wiring)
    yield Hop("robot", robot, spec.robots[robot].type)


def _last_hops(link: Serial | Bluetooth | None, wiring: Wiring) -> Iterator[Hop]:
    if link is None:
        return
    if isinstance(link, Bluetooth) and (adapter := wiring.adapter(link)) is not None:
        yield Hop("adapter", adapter[1])
    yield Hop("line", link.robot, line_kind(link))
