"""Links to robots that have an address of their own: by UDP or TCP."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from swarmctl.field_types import Port, RobotAddress, SystemId
from swarmctl.links.link_base import Ends, RobotLink
from swarmctl.units import Unit


class IpLink(RobotLink):
    """What a udp and a tcp link have in common: a robot with an address of its own."""

    header_bytes: ClassVar[int]  # around the data of a packet: Ethernet, IP, and UDP or TCP
    device_keys: ClassVar[tuple[str, ...]] = ("address", "port", "local_ports", "system_id")
    type_keys: ClassVar[tuple[str, ...]] = ("port", "local_ports", "load_mbps", "host_address")
    placeholders: ClassVar[Mapping[str, str]] = {
        "link_address": "the address of its {} link",
        "link_port": "the robot's port of its {} link",
        "local_port": "the first of the `local_ports` of its {} link",
        "local_port_2": "the second of the `local_ports` of its {} link",
        "system_id": "the vehicle's MAVLink system id, of its {} link",
        "uri": "its link as a URI: {}",
    }
    example: ClassVar[str] = "address: ..."
    unknown_end: ClassVar[Mapping[str, str]] = {"address": "192.168.77.50"}
    where_to_find: ClassVar[str] = "the robot's own address"

    address: RobotAddress = Field(description="The robot's own address, IPv4 or a name.")
    port: Port | None = Field(
        None, examples=[8889], description="The robot's port; the robot type's own by default."
    )
    local_ports: tuple[Port, ...] | None = Field(
        None,
        max_length=8,
        examples=[[8890, 6038]],
        description="Ports of the host on which the driver receives what this robot sends; the robot type's "
        "own by default.",
    )
    host_address: RobotAddress | None = Field(
        None,
        examples=["192.168.186.3"],
        description="The host's address on a network that it shares with this robot alone, such as that of a "
        "USB cable: its discovery server or router listens there, too, for a robot that runs nodes itself. "
        "The robot type's own by default.",
    )
    system_id: SystemId = 1
    capacity_mbps: Annotated[float, Field(gt=0, le=100_000), Unit("Mbit/s")] | None = Field(
        None,
        examples=[5.0],
        description="Throughput between host and robot, as iperf3 or a download measures it; unknown when "
        "left out.",
    )
    latency: Annotated[float, Field(gt=0, le=10), Unit("s")] | None = Field(
        None,
        examples=[0.02],
        description="Time from host to robot and back, as `ping` shows it; unknown when left out.",
    )

    @classmethod
    def first_value(cls, number: int, robot: str, dongle: int) -> str:
        return f"192.168.77.{100 + number}"

    def label(self, adapter: str | None, port: int | None) -> str:
        return f"{self.address}:{port}" if port is not None else self.address

    def values(self, ends: Ends) -> dict[str, str | int]:
        values: dict[str, str | int] = {"link_address": self.address, "system_id": self.system_id}
        values |= dict(zip(("local_port", "local_port_2"), ends.local_ports, strict=False))
        if ends.port is not None:
            values |= {"link_port": ends.port, "uri": self.uri(ends.port, ends.local_ports)}
        return values

    def uri(self, port: int, local_ports: tuple[int, ...]) -> str:
        """Returns the link as a URI of mavros."""
        return f"{self.kind}://{self.address}:{port}"

    def moving(self, host: str) -> str:
        return f"check that `{host}` reaches `{self.robot}` at {self.address}: `ping {self.address}` there"

    def check(self, host: str) -> str:
        return f"on {host}: ping -c 3 {self.address}; without an answer it is off or elsewhere"


class Udp(IpLink):
    """A connection by UDP between a host and a robot with an address of its own."""

    header_bytes: ClassVar[int] = 42
    title: ClassVar[str] = "udp"

    kind: Literal["udp"] = Field(description="What kind of link this is.")

    def uri(self, port: int, local_ports: tuple[int, ...]) -> str:
        """Returns the link as mavros takes it, from the first port of the host: udp://:14550@HOST:14555."""
        own = f":{local_ports[0]}@" if local_ports else ""
        return f"udp://{own}{self.address}:{port}"


class Tcp(IpLink):
    """A connection by TCP between a host and a robot with an address of its own."""

    header_bytes: ClassVar[int] = 66  # with the time stamp of TCP
    title: ClassVar[str] = "tcp"

    kind: Literal["tcp"] = Field(description="What kind of link this is.")
