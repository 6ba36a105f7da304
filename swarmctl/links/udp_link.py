"""A connection by UDP between a host and a robot with an address of its own."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from swarmctl.links.ip_link import IpLink


class Udp(IpLink):
    """A connection by UDP between a host and a robot with an address of its own."""

    header_bytes: ClassVar[int] = 42
    title: ClassVar[str] = "udp"

    kind: Literal["udp"] = Field(description="What kind of link this is.")

    def uri(self, port: int, local_ports: tuple[int, ...]) -> str:
        """Returns the link as mavros takes it, from the first port of the host: udp://:14550@HOST:14555."""
        own = f":{local_ports[0]}@" if local_ports else ""
        return f"udp://{own}{self.address}:{port}"
