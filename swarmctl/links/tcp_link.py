"""A connection by TCP between a host and a robot with an address of its own."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from swarmctl.links.ip_link import IpLink


class Tcp(IpLink):
    """A connection by TCP between a host and a robot with an address of its own."""

    header_bytes: ClassVar[int] = 66  # with the time stamp of TCP
    title: ClassVar[str] = "tcp"

    kind: Literal["tcp"] = Field(description="What kind of link this is.")
