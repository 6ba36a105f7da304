"""What links have in common: networks between hosts, links between a host and a robot.

The class of a kind of link declares its keys in a spec, and answers what other code asks of such a link.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol

from pydantic import Field

from swarmctl.field_types import HostName, Model, NetworkName, RobotName, SelectedHost, Subnet
from swarmctl.units import Unit


class NetworkLink(Model):
    """What a wlan and an ethernet have in common."""

    usual_mbps: ClassVar[float]  # between two hosts, where the spec has no `capacity_mbps`
    interface_stem: ClassVar[str]  # how the names of its interfaces begin
    wireless: ClassVar[bool] = False

    kind: str
    name: NetworkName = Field(description="Name of the network.")
    hosts: tuple[SelectedHost, ...] = Field(
        min_length=1, description="The hosts on it, or selections of them."
    )
    subnet: Subnet | None = Field(
        None, description="Its addresses; by default the /24 around the hosts' own."
    )
    multicast: bool | None = Field(None, description="Whether multicast passes; unknown when left out.")
    capacity_mbps: Annotated[float, Field(gt=0, le=100_000), Unit("Mbit/s")] | None = Field(
        None,
        examples=[35.0],
        description="Throughput between two of its hosts, as iperf3 measures it; 10 for a wlan and 90 for an "
        "ethernet by default.",
    )


class Ends(NamedTuple):
    """What a driver uses of a link: the device at the host, bits per second, and the ports at both ends."""

    device: str = ""
    baud: int | None = None
    port: int | None = None
    local_ports: tuple[int, ...] = ()


class Device(Protocol):
    """The device of a line at its host."""

    @property
    def path(self) -> str:
        """Its path."""

    @property
    def title(self) -> str:
        """What it is, in a sentence."""


class RobotLink(Model):
    """A link between a host and a robot."""

    wired: ClassVar[bool] = False  # drawn as a solid line; a swap of robots with a cable exchanges the hosts
    device_keys: ClassVar[tuple[str, ...]] = ()  # belong to the robot: a swap exchanges them
    type_keys: ClassVar[tuple[str, ...]] = ()  # of a robot type's `link`, which only links of this kind have
    adapters_key: ClassVar[str] = ""  # of a host: lists the adapters that such a link needs
    title: ClassVar[str]  # in a sentence
    placeholders: ClassVar[Mapping[str, str]] = {}  # with their meaning, where {} stands for titles of kinds
    example: ClassVar[str]  # the keys of the robot's end, as they are written in a spec
    unknown_end: ClassVar[Mapping[str, Any]]  # an example of these keys
    where_to_find: ClassVar[str]  # the value for them

    kind: str
    host: HostName = Field(description="The host at one end.")
    robot: RobotName = Field(description="The robot at the other.")

    @classmethod
    def first_value(cls, number: int, robot: str, dongle: int) -> str:
        """Returns what stands for the end of the ``number``-th robot in a new spec, to be filled in.

        ``dongle`` is the number of the dongle that would serve it.
        """
        return ""

    @property
    def own_baud(self) -> int | None:
        """Bits per second, where the link declares them."""
        return None

    @property
    def line_kind(self) -> str:
        """What exchanges over the link take their time by: its kind, or that of its adapter."""
        return self.kind

    def served_by(self, adapters: tuple[str, ...]) -> str | None:
        """Returns what serves the link at its host, and can serve others; ``adapters`` are the host's."""
        return None

    def device_of(self, number: int, channel: int, adapter: str) -> Device | None:
        """Returns the device at the host, if there is one.

        ``number`` is the next one free of the host's rfcomm devices, ``channel`` the robot type's.
        """
        return None

    def label(self, adapter: str | None, port: int | None) -> str:
        """Returns what identifies the link at its host; ``port`` is the robot's."""
        return adapter or ""

    def values(self, ends: Ends) -> dict[str, str | int]:
        """Returns the values of its placeholders, as far as they are known."""
        return {}

    def moving(self, host: str) -> str:
        """Returns what a person has to do when the link moves to ``host``."""
        return f"plug the line of `{self.robot}` into `{host}` instead of `{self.host}`"

    def check(self, host: str) -> str:
        """Returns what to check on ``host`` if the robot does not answer; empty if its driver says it."""
        return ""


class Delay(NamedTuple):
    """Seconds between the end of a request and its reply."""

    usual: float
    least: float


class Line(RobotLink):
    """A link with a device at the host, over which swarmctl's own driver can send bytes."""

    delays: ClassVar[Mapping[str, Delay]]  # by ``line_kind``, that of an unknown adapter first

    def values(self, ends: Ends) -> dict[str, str | int]:
        """Returns the device, and with bits per second these and a URI."""
        if not ends.baud:
            return {"device": ends.device}
        uri = f"serial://{ends.device}:{ends.baud}"
        return {"device": ends.device, "baud": ends.baud, "uri": uri}
