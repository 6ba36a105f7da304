"""What runs on each host and crosses each network, beside what they can bear. Pure numbers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass

from swarmctl.spec.model import Computer, Control, NetworkLink, Spec
from swarmctl.spec.multimaster import Multimaster
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.settings import merged
from swarmctl.topology import modes, names
from swarmctl.topology.boards import message_bytes
from swarmctl.topology.bridges import commanders_host
from swarmctl.topology.interfaces import (
    COMMAND,
    COMMAND_TYPE,
    Endpoint,
    driver_topics,
    program_host,
)
from swarmctl.topology.lines import COMMAND_RATE, command_rates, layers
from swarmctl.topology.swarm import Bridge, Island

# MB. A driver may take 60 (its bar); rosmaster, our own multimaster and each of fkie's two nodes are Python
# programs like it, rosout is smaller. A Linux without a desktop takes 100 to 200, as Raspberry Pi OS Lite
# does.
DRIVER_MB = 60
MASTER_MB = 100
BRIDGE_MB = {"fkie": 120, "static": 60}
SYSTEM_MB = 200
SMALL_MB = 1024  # computers with no more memory than this are slow as well: Raspberry Pi 1 to 3, Zero
SMALL_NODES = 20  # that such a computer's master should serve at most; a rule of thumb
CAREFUL = 0.8  # share of the memory above which a host begins to swap

# Mbit/s between two hosts. 802.11g carries about 22, and a packet goes to the access point and on from there;
# a Raspberry Pi up to 3B has fast ethernet, 94 with TCP.
CAPACITY = {"wlan": 10.0, "ethernet": 90.0}
CAREFUL_NETWORK = 0.7
_TCP_HEADERS = 66  # bytes of ethernet, IP and TCP with its time stamp, for each of the segments below
_SEGMENT = 1448


@dataclass(frozen=True)
class HostBudget:
    """The memory of a host whose kind of computer is known, and the nodes that its master serves."""

    host: str
    computer: str
    memory_mb: int
    parts: tuple[tuple[str, int], ...]  # what takes how many MB
    served: int  # nodes of the island whose master it runs; 0 where it runs none

    @property
    def needed_mb(self) -> int:
        return sum(size for _, size in self.parts)

    @property
    def share(self) -> float:
        return self.needed_mb / self.memory_mb

    @property
    def small(self) -> bool:
        return self.memory_mb <= SMALL_MB

    def to_json(self) -> dict[str, object]:
        return {
            "host": self.host,
            "computer": self.computer,
            "memory_mb": self.memory_mb,
            "needed_mb": self.needed_mb,
            "parts": dict(self.parts),
            "share": round(self.share, 3),
            "nodes_served": self.served,
        }


@dataclass(frozen=True)
class Flow:
    """A topic that goes from one host to another over a network."""

    topic: str
    origin: str
    to: str
    bytes_per_second: float


@dataclass(frozen=True)
class NetworkBudget:
    """What crosses one network, as far as rates and sizes are known."""

    network: str
    kind: str
    capacity_mbps: float
    flows: tuple[Flow, ...]

    @property
    def needed_mbps(self) -> float:
        return sum(flow.bytes_per_second for flow in self.flows) * 8 / 1e6

    @property
    def share(self) -> float:
        return self.needed_mbps / self.capacity_mbps

    def largest(self, count: int) -> list[Flow]:
        """The flows that matter most, each at least a hundredth of the whole."""
        worth = [flow for flow in self.flows if flow.bytes_per_second * 8e2 >= self.needed_mbps * 1e6]
        return sorted(worth, key=lambda flow: -flow.bytes_per_second)[:count]

    def to_json(self) -> dict[str, object]:
        return {
            "network": self.network,
            "kind": self.kind,
            "mbps": round(self.needed_mbps, 3),
            "mbps_available": self.capacity_mbps,
            "share": round(self.share, 4),
            "flows": len(self.flows),
        }


def host_budgets(
    spec: Spec, computers: Mapping[str, Computer], islands: Sequence[Island], bridges: Iterable[Bridge]
) -> Iterator[HostBudget]:
    """Every host whose kind of computer is known, in the order of the spec."""
    drivers: Counter[str | None] = Counter(modes.driving_host(spec, robot) for robot in spec.robots)
    programs: dict[str, list[tuple[str, int]]] = {}
    nodes = drivers.copy()
    for name, program in spec.programs.items():
        host = program_host(spec, program)
        if host is not None:
            nodes[host] += 1
            programs.setdefault(host, []).append((name, program.memory_mb or 0))
    served = {island.hub: sum(nodes[host] for host in island.hosts) for island in islands}
    provider = (spec.multimaster or Multimaster()).provider
    joining = _joining(provider, islands, bridges)
    for name, given in spec.hosts.items():
        kind = given.computer or spec.defaults.host.computer
        if kind is None:
            continue
        parts = [
            ("system", SYSTEM_MB),
            ("master", MASTER_MB if name in served else 0),
            ("multimaster", BRIDGE_MB[provider] if name in joining else 0),
            (f"{drivers[name]} driver{'s' if drivers[name] > 1 else ''}", drivers[name] * DRIVER_MB),
            *programs.get(name, ()),
        ]
        taken = tuple(part for part in parts if part[1])
        yield HostBudget(name, kind, computers[kind].memory_mb, taken, served.get(name, 0))


def _joining(provider: str, islands: Sequence[Island], bridges: Iterable[Bridge]) -> Set[str]:
    """The hubs that run a multimaster: with `static` those that hear something, with fkie's packages all."""
    if provider == "static":
        hearing = {to for bridge in bridges for to in bridge.to}
        return {island.hub for island in islands if island.name in hearing}
    return {island.hub for island in islands} if len(islands) > 1 else frozenset()


def network_budgets(
    spec: Spec, types: Mapping[str, RobotType], endpoints: Sequence[Endpoint], islands: Sequence[Island]
) -> Iterator[NetworkBudget]:
    """Every network, in the order of the spec. Two hosts talk over the first network that they share."""
    carried: dict[str, list[Flow]] = {}
    over = _Ways(spec)
    for flow in _flows(spec, types, endpoints, islands):
        network = over.way(flow.origin, flow.to)
        if network is not None:
            carried.setdefault(network, []).append(flow)
    for link in spec.links:
        if isinstance(link, NetworkLink):
            capacity = link.capacity_mbps or CAPACITY[link.kind]
            yield NetworkBudget(link.name, link.kind, capacity, tuple(carried.get(link.name, ())))


class _Ways:
    """Which network two hosts talk over."""

    def __init__(self, spec: Spec) -> None:
        self._networks: dict[str, list[str]] = {}
        for link in spec.links:
            if isinstance(link, NetworkLink):
                for host in link.hosts:
                    self._networks.setdefault(host, []).append(link.name)

    def way(self, one: str, other: str) -> str | None:
        beside = self._networks.get(other, ())
        return next((name for name in self._networks.get(one, ()) if name in beside), None)


def _flows(
    spec: Spec, types: Mapping[str, RobotType], endpoints: Sequence[Endpoint], islands: Sequence[Island]
) -> Iterator[Flow]:
    """What is published on one host and heard on another, with a known rate and size."""
    heard: dict[str, set[str]] = {}
    for one in endpoints:
        if not one.publishes and one.host:
            heard.setdefault(one.topic, set()).add(one.host)
    if spec.multimaster is not None:
        _heard_by_people(spec.multimaster, islands, heard)
    orders = command_rates(spec, endpoints)
    for control in spec.control:
        yield from _orders(spec, control, orders)
    for one in endpoints:
        size = message_bytes(one.type, one.size) if one.publishes and one.rate else None
        if size is not None and one.rate is not None:
            yield from _to_each(one.topic, one.host, heard, one.rate, size)
    if heard:
        yield from _sensors(spec, types, heard)


def _heard_by_people(multimaster: Multimaster, islands: Sequence[Island], heard: dict[str, set[str]]) -> None:
    """Add the topics that cross by name: where no program hears one, somebody on the hub does."""
    called = {island.name: island for island in islands}
    for crossing in multimaster.topics:
        hosts = heard.setdefault(crossing.topic, set())
        for island in (called[to] for to in crossing.to if to in called):
            if hosts.isdisjoint(island.hosts):
                hosts.add(island.hub)


def _orders(spec: Spec, control: Control, rates: Mapping[str, float]) -> Iterator[Flow]:
    origin, size = commanders_host(spec, control.by), message_bytes(COMMAND_TYPE, None) or 0
    for robot in control.of:
        to = modes.driving_host(spec, robot)
        if origin is not None and to is not None and origin != to:
            topic = f"{names.namespace(robot)}/{COMMAND}"
            yield Flow(topic, origin, to, rates.get(robot, COMMAND_RATE) * on_the_wire(size))


def _sensors(spec: Spec, types: Mapping[str, RobotType], heard: Mapping[str, set[str]]) -> Iterator[Flow]:
    spaces = {names.parted(topic)[0] for topic in heard}
    for name, robot in spec.robots.items():
        prefix = names.namespace(name)
        if prefix not in spaces:
            continue
        host, robot_type = modes.driving_host(spec, name), types[robot.type]
        if host is None:
            continue
        for one in driver_topics(robot_type, merged(*layers(spec, robot_type, robot.settings)), robot.driver):
            yield from _to_each(f"{prefix}/{one.name}", host, heard, one.rate, one.size)


def _to_each(
    topic: str, origin: str, heard: Mapping[str, set[str]], rate: float, size: int
) -> Iterator[Flow]:
    for to in sorted(heard.get(topic, ())):
        if to != origin:
            yield Flow(topic, origin, to, rate * on_the_wire(size))


def on_the_wire(size: int) -> int:
    """Bytes of a message with its length before it, in as many TCP segments as it takes."""
    return size + 4 + _TCP_HEADERS * -(-(size + 4) // _SEGMENT)
