"""Both ends of a udp or tcp link: what the spec leaves out comes from the robot type. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from swarmctl.links.ip_link import IpLink
from swarmctl.links.link_base import NetworkLink
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.swarm.addresses import Subnet, ip_of


@dataclass(frozen=True)
class IpEnds:
    """A udp or tcp link: the robot's ``port``, the ports of its host, what both exchange, and their network.

    ``port`` and ``load_mbps`` are None if neither the link nor the robot type has them; ``network`` is None
    if the robot's address lies in no network of the host.
    """

    link: IpLink
    port: int | None
    local_ports: tuple[int, ...]
    load_mbps: float | None
    network: NetworkLink | None


def ends_of(
    link: IpLink, kind: AnyRobotType | None, networks: Iterable[tuple[NetworkLink, Subnet | None]]
) -> IpEnds:
    """Returns both ends of a link to a robot of type ``kind``; ``networks`` are those of its host."""
    usual = kind.link if isinstance(kind, RosRobotType) else None
    ip = ip_of(link.address)
    inside = (
        network for network, subnet in networks if ip is not None and subnet is not None and ip in subnet
    )
    local = link.local_ports
    return IpEnds(
        link,
        link.port or (usual.port if usual is not None else None),
        local if local is not None else usual.local_ports if usual is not None else (),
        usual.load_mbps if usual is not None else None,
        next(inside, None),
    )
