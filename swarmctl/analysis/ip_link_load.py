"""What robots with a udp or tcp link and their hosts exchange, and what the link carries. Pure numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.analysis.rosserial_load import message_bytes
from swarmctl.analysis.serial_load import COMMAND_RATE, command_rates
from swarmctl.links.ip_link import IpLink
from swarmctl.swarm.index import SwarmIndex

_SEGMENT = 1448


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
        link, network, measured = ends.link, ends.network, ends.load_mbps
        yield IpLinkBudget(
            link.robot,
            link.host,
            link.kind,
            number,
            network.name if network is not None else None,
            measured if measured is not None else _computed(index, link, rates) * 8 / 1e6,
            link.capacity_mbps,
        )


def _computed(index: SwarmIndex, link: IpLink, rates: Mapping[str, float]) -> float:
    """Bytes a second of a robot's commands and topics."""
    flows = [(one.rate, one.size) for one in index.driver_topics(link.robot) if one.size]
    command = index.command_topics.get(link.robot)
    if command is not None:
        flows.append((rates.get(link.robot, COMMAND_RATE), message_bytes(command.type, None) or 0))
    return sum(rate * (size + link.header_bytes * -(-size // _SEGMENT)) for rate, size in flows)
