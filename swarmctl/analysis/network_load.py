"""The topics that are sent over each network, beside what the network can carry. Pure numbers."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass

from swarmctl.analysis.ip_link_load import ip_link_budgets
from swarmctl.analysis.rosserial_load import message_bytes
from swarmctl.analysis.serial_load import COMMAND_RATE, command_rates
from swarmctl.spec.model import Control
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.recordings import Recording, recording_of

CAREFUL_NETWORK = 0.7
_TCP_HEADERS = 66  # bytes of ethernet, IP and TCP with its time stamp, for each of the segments below
_SEGMENT = 1448

Subscribers = Mapping[str, set[str]]  # by topic, the hosts that subscribe to it


@dataclass(frozen=True)
class Flow:
    """A topic that is sent from one host to another over a network, or the link of a robot with its host."""

    topic: str
    origin: str
    to: str
    bytes_per_second: float


@dataclass(frozen=True)
class NetworkBudget:
    """The flows over one network, as far as their rates and sizes are known."""

    network: str
    kind: str
    capacity_mbps: float
    flows: tuple[Flow, ...]

    @property
    def needed_mbps(self) -> float:
        """The load of all flows, in Mbit/s."""
        return sum(flow.bytes_per_second for flow in self.flows) * 8 / 1e6

    @property
    def share(self) -> float:
        """The used share of the capacity; above 1 it is overloaded."""
        return self.needed_mbps / self.capacity_mbps

    def largest(self, count: int) -> list[Flow]:
        """Returns the ``count`` largest flows, without those below one percent of the whole."""
        worth = [flow for flow in self.flows if flow.bytes_per_second * 8e2 >= self.needed_mbps * 1e6]
        return sorted(worth, key=lambda flow: -flow.bytes_per_second)[:count]

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "network": self.network,
            "kind": self.kind,
            "mbps": round(self.needed_mbps, 3),
            "mbps_available": self.capacity_mbps,
            "share": round(self.share, 4),
            "flows": len(self.flows),
        }


def network_budgets(index: SwarmIndex) -> Iterator[NetworkBudget]:
    """Yields the budget of every network, in the order of the spec.

    Two hosts use the first network they share, a robot with an address the one in which that lies.
    """
    carried: dict[str, list[Flow]] = {}
    for flow in _flows(index):
        if shared := index.shared_networks(flow.origin, flow.to):
            carried.setdefault(shared[0], []).append(flow)
    for one in ip_link_budgets(index):
        if one.network is not None:
            flow = Flow(f"{one.kind} link of {one.robot}", one.host, one.robot, one.needed_mbps * 1e6 / 8)
            carried.setdefault(one.network, []).append(flow)
    for _, link in index.networks:
        capacity = link.capacity_mbps or link.usual_mbps
        yield NetworkBudget(link.name, link.kind, capacity, tuple(carried.get(link.name, ())))


def _flows(index: SwarmIndex) -> Iterator[Flow]:
    """What is published on one host and subscribed to on another, with a known rate and size."""
    subscribers = _subscribers(index)
    rates = command_rates(index)
    declared = {(one.topic, one.host) for one in index.endpoints if one.publishes and one.rate}
    for control in index.spec.control:
        yield from _command_flows(index, control, rates, subscribers, declared)
    for one in index.endpoints:
        size = message_bytes(one.type, one.size) if one.publishes and one.rate else None
        if size is not None and one.rate is not None:
            yield from _flows_of(one.topic, one.host, subscribers, one.rate, size)
    if subscribers:
        yield from _sensor_flows(index, subscribers)


def _subscribers(index: SwarmIndex) -> Subscribers:
    """The hosts of the programs that subscribe to each topic.

    If no program on an island subscribes to a topic that `multimaster.topics` sends there, its hub counts.
    A `rosbag record` subscribes to what it selects among the topics of its island.
    """
    found: dict[str, set[str]] = {}
    for one in index.endpoints:
        if not one.publishes and one.host:
            found.setdefault(one.topic, set()).add(one.host)
    islands = {island.name: island for island in index.islands}
    multimaster = index.spec.multimaster
    for declared in multimaster.topics if multimaster else ():
        hosts = found.setdefault(declared.topic, set())
        for island in (islands[to] for to in declared.to if to in islands):
            if hosts.isdisjoint(island.hosts):
                hosts.add(island.hub)
    for host, recording in _recordings(index):
        for topic in filter(recording.takes, _known_at(index, host)):
            found.setdefault(topic, set()).add(host)
    return found


def _recordings(index: SwarmIndex) -> Iterator[tuple[str, Recording]]:
    """Every `rosbag record` with its host."""
    for name, program in index.spec.programs.items():
        host, namespace = index.program_hosts[name], index.program_namespaces[name]
        given = {"swarm": index.spec.name, "program": name, "host": host, "robot": program.robot}
        values = {**{key: one for key, one in given.items() if one}, "namespace": namespace.strip("/")}
        recording = recording_of(program, index.program_nodes[name], values)
        if recording is not None and host is not None and host in index.home:
            yield host, recording


def _known_at(index: SwarmIndex, host: str) -> Iterator[str]:
    """The topics at the master of ``host``, by full name: published on its island, or bridged to it."""
    island = index.home[host]
    yield from (one.topic for one in index.endpoints if one.publishes and one.host in island.hosts)
    for name, namespace in index.namespaces.items():
        if index.driving[name] in island.hosts:
            own = (one.name for one in index.driver_topics(name) if not one.name.startswith("/"))
            yield from (f"{namespace}/{one}" for one in own)
            if (command := index.command_topics.get(name)) is not None:
                yield command.topic
    yield from (one.topic for one in bridges_of(index) if island.name in one.to)


def _command_flows(
    index: SwarmIndex,
    control: Control,
    rates: Mapping[str, float],
    subscribers: Subscribers,
    declared: Container[tuple[str, str]],
) -> Iterator[Flow]:
    """Commands to the drivers, and to other subscribers unless a program declares this topic on this host."""
    origin = index.commander_host(control.by)
    for robot in control.of:
        to, command = index.driving[robot], index.command_topics.get(robot)
        if origin is not None and to is not None and command is not None:
            size, rate = message_bytes(command.type, None) or 0, rates.get(robot, COMMAND_RATE)
            if origin != to:
                yield Flow(command.topic, origin, to, rate * on_the_wire(size))
            if (command.topic, origin) not in declared:
                yield from _flows_of(command.topic, origin, subscribers, rate, size)


def _sensor_flows(index: SwarmIndex, subscribers: Subscribers) -> Iterator[Flow]:
    namespaces = {index.split_topic(topic)[0] for topic in subscribers}
    for namespace, name in index.robot_by_namespace.items():
        host = index.driving[name] if namespace in namespaces else None
        if host is None:
            continue
        for one in index.driver_topics(name):
            yield from _flows_of(f"{namespace}/{one.name}", host, subscribers, one.rate, one.size)


def _flows_of(topic: str, origin: str, subscribers: Subscribers, rate: float, size: int) -> Iterator[Flow]:
    for to in sorted(subscribers.get(topic, ())):
        if to != origin:
            yield Flow(topic, origin, to, rate * on_the_wire(size))


def on_the_wire(size: int) -> int:
    """Bytes of a message with its length before it, in as many TCP segments as it takes."""
    return size + 4 + _TCP_HEADERS * -(-(size + 4) // _SEGMENT)
