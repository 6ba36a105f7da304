"""What each network and each udp or tcp link of a robot has to carry, beside its capacity. Pure numbers."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from swarmctl.analysis.rosserial_load import message_bytes
from swarmctl.analysis.serial_load import command_rates
from swarmctl.links.ip_link import Tcp
from swarmctl.swarm.addresses import IpEnds
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.recordings import Recording, recording_of

CAREFUL_NETWORK = 0.7
_SEGMENT = 1448  # bytes of data in a full packet
_LENGTH = 4  # bytes before each message of TCPROS


class Source(NamedTuple):
    """A topic that is published on a host, with its rate in Hz and the size of a message in bytes."""

    topic: str
    host: str
    rate: float
    size: int


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


@dataclass(frozen=True)
class IpLinkBudget:
    """The load of one udp or tcp link; ``network`` is the one between its ends, if the spec has it."""

    robot: str
    host: str
    kind: str
    link: int  # its index in ``links``
    network: str | None
    needed_mbps: float
    capacity_mbps: float | None

    @property
    def share(self) -> float | None:
        """The used share of the capacity; None if that is unknown."""
        return self.needed_mbps / self.capacity_mbps if self.capacity_mbps is not None else None

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "robot": self.robot,
            "host": self.host,
            "kind": self.kind,
            "network": self.network,
            "mbps": round(self.needed_mbps, 4),
            "mbps_available": self.capacity_mbps,
            "share": None if self.share is None else round(self.share, 4),
        }


def ip_link_budgets(index: SwarmIndex) -> Iterator[IpLinkBudget]:
    """Yields the budget of every udp and tcp link, in the order of the spec.

    The load is what the robot type declares as measured. Else it is that of the commands and of the topics of
    known rate and size, as if the robot sent each message as ROS does; images of unknown size count nothing.
    """
    rates = command_rates(index) if index.ip_links else {}
    for number, ends in index.ip_links.items():
        link, network = ends.link, ends.network.name if ends.network is not None else None
        mbps = ends.load_mbps if ends.load_mbps is not None else _computed_mbps(index, ends, rates)
        yield IpLinkBudget(link.robot, link.host, link.kind, number, network, mbps, link.capacity_mbps)


def _computed_mbps(index: SwarmIndex, ends: IpEnds, rates: Mapping[str, float]) -> float:
    """The load of a robot's commands and topics."""
    robot, headers = ends.link.robot, ends.link.header_bytes
    flows = [(one.rate, one.size) for one in index.driver_topics(robot)]
    if (command := index.command_topics.get(robot)) is not None:
        flows.append((rates[robot], message_bytes(command.type, None) or 0))
    return sum(rate * _with_headers(size, headers) for rate, size in flows) * 8 / 1e6


def network_budgets(index: SwarmIndex) -> Iterator[NetworkBudget]:
    """Yields the budget of every network, in the order of the spec.

    Two hosts use the first network they share, a robot with an address the one in which that lies.
    """
    carried: dict[str, list[Flow]] = {link.name: [] for _, link in index.networks}
    for flow in _flows(index):
        on_host = flow.origin in index.spec.hosts
        if on_host and (shared := index.shared_networks(flow.origin, flow.to)):
            carried[index.network_at[shared[0]].name].append(flow)
    for one in ip_link_budgets(index):
        if one.network is not None:
            flow = Flow(f"{one.kind} link of {one.robot}", one.host, one.robot, one.needed_mbps * 1e6 / 8)
            carried[one.network].append(flow)
    for _, link in index.networks:
        capacity = link.capacity_mbps or link.usual_mbps
        yield NetworkBudget(link.name, link.kind, capacity, tuple(carried[link.name]))


def _flows(index: SwarmIndex) -> Iterator[Flow]:
    """What is published on one host and subscribed to on another."""
    recordings = tuple(_recordings(index))
    sources = tuple(_sources(index, None if recordings else _subscribed_namespaces(index)))
    subscribers = _subscribers(index, sources, recordings)
    for one in sources:
        for to in sorted(subscribers.get(one.topic, ())):
            if to != one.host:
                yield Flow(one.topic, one.host, to, one.rate * on_the_wire(one.size))


def _subscribed_namespaces(index: SwarmIndex) -> Container[str]:
    """The namespaces in which something other than a driver subscribes: those of few robots."""
    topics = [one.topic for one in index.endpoints if not one.publishes]
    topics += [one.topic for one in (index.spec.multimaster.topics if index.spec.multimaster else ())]
    return {index.split_topic(topic)[0] for topic in topics}


def _sources(index: SwarmIndex, subscribed: Container[str] | None) -> Iterator[Source]:
    """What programs, commanders and drivers publish with a known rate and size.

    Only drivers in the namespaces ``subscribed``, and those of other packages, whose topics may be
    anywhere; None: all.
    """
    declared = set[tuple[str, str]]()  # topic, program
    for one in index.endpoints:
        size = message_bytes(one.type, one.size)
        if one.publishes and one.rate is not None and size is not None:
            declared.add((one.topic, one.owner))
            yield Source(one.topic, one.host, one.rate, size)
    rates, commands, foreign = command_rates(index), index.command_topics, index.ros_drivers
    for control in index.spec.control:
        origin = index.commander_host(control.by)
        for robot in control.of if origin is not None else ():
            command = commands.get(robot)
            if origin is not None and command is not None and (command.topic, control.by) not in declared:
                yield Source(command.topic, origin, rates[robot], message_bytes(command.type, None) or 0)
    for namespace, robot in index.robot_by_namespace.items():
        is_wanted = subscribed is None or namespace in subscribed or robot in foreign
        if is_wanted and (host := index.driving[robot]) is not None:
            for sent in index.driver_topics(robot):
                if sent.rate and sent.size:
                    name = sent.name if sent.name.startswith("/") else f"{namespace}/{sent.name}"
                    yield Source(name, host, sent.rate, sent.size)


def _subscribers(
    index: SwarmIndex, sources: Iterable[Source], recordings: Iterable[tuple[str, Recording]]
) -> Mapping[str, set[str]]:
    """The hosts on which each topic is subscribed to: by drivers, programs and recordings.

    If nothing on an island subscribes to a topic that `multimaster.topics` sends there, its hub counts.
    A `rosbag record` subscribes to what it selects among the topics of its island.
    """
    found: dict[str, set[str]] = {}
    for robot, command in index.command_topics.items():
        if (host := index.driving[robot]) is not None:
            found.setdefault(command.topic, set()).add(host)
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
    for host, recording in recordings:
        home = index.home[host]
        known = {one.topic for one in sources if one.host in home.hosts}
        known.update(one.topic for one in bridges_of(index) if home.name in one.to)
        for topic in filter(recording.takes, known):
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


def on_the_wire(size: int) -> int:
    """Bytes of a message with its length before it, in as many TCP segments as it takes."""
    return _with_headers(size + _LENGTH, Tcp.header_bytes)


def _with_headers(size: int, headers: int) -> int:
    return size + headers * -(-size // _SEGMENT)
