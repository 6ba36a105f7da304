"""The links of a spec as frozen models: networks between hosts, lines between hosts and robots."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from swarmctl.field_types import (
    RADIO_RATES,
    Adapter,
    Baud,
    DevicePath,
    HexId,
    HostName,
    Mac,
    Model,
    NetworkName,
    Port,
    RadioUri,
    RobotAddress,
    RobotName,
    SelectedHost,
    Subnet,
    UsbPort,
    UsbText,
)
from swarmctl.spec.named_secret import Secret
from swarmctl.units import Unit


class Usb(Model):
    """Identity of a USB serial adapter, as udev sees it: its serial number, or the port it is in."""

    lone_key: ClassVar[str] = "serial"  # what a text in the place of this mapping is

    serial: UsbText | None = Field(
        None, description="The adapter's serial number (`udevadm info -a`, ATTRS{serial})."
    )
    path: UsbPort | None = Field(
        None,
        description="The USB port, for an adapter without a serial number, such as a CH340 "
        "(`udevadm info -a`, KERNELS next to the adapter's ATTRS{idVendor}). The adapter has to stay in it.",
    )
    vendor: HexId | None = Field(None, description="Vendor id, four hexadecimal digits.")
    product: HexId | None = Field(None, description="Product id, four hexadecimal digits.")

    @property
    def identity(self) -> str:
        """What distinguishes the adapter from others of its model on a host."""
        return self.path or self.serial or ""


class NetworkLink(Model):
    """What a wlan and an ethernet have in common."""

    kind: Literal["wlan", "ethernet"]
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


class Wlan(NetworkLink):
    """A wireless network between hosts."""

    kind: Literal["wlan"] = Field(description="What kind of link this is.")
    client_isolation: bool | None = Field(
        None, description="Whether the access point keeps its clients apart."
    )


class Ethernet(NetworkLink):
    """A wired network between hosts."""

    kind: Literal["ethernet"] = Field(description="What kind of link this is.")


class Serial(Model):
    """A serial line between a host and a robot: a USB adapter by its identity, or a fixed device."""

    kind: Literal["serial"] = Field(description="What kind of link this is.")
    host: HostName = Field(description="The host at one end.")
    robot: RobotName = Field(description="The robot at the other.")
    usb: Usb | None = Field(None, description="The USB adapter; the device is then /dev/swarm/<robot>.")
    device: DevicePath | None = Field(
        None, description="A device that never changes its name, such as /dev/ttyS0."
    )
    baud: Baud | None = Field(None, description="Bits per second; the robot type's own by default.")


class Bluetooth(Model):
    """A Bluetooth serial connection (RFCOMM) between a host and a robot."""

    kind: Literal["bluetooth"] = Field(description="What kind of link this is.")
    host: HostName = Field(description="The host at one end.")
    robot: RobotName = Field(description="The robot at the other.")
    mac: Mac = Field(description="The robot's Bluetooth address, in quotes.")
    pin: Secret | None = Field(
        None, description="Pairing PIN as {secret: NAME}; a spec never contains the PIN itself."
    )
    adapter: Adapter | None = Field(None, description="Which adapter of the host; its first by default.")
    channel: int | None = Field(
        None, ge=1, le=30, examples=[1], description="RFCOMM channel; the robot type's own by default."
    )


class IpLink(Model):
    """What a udp and a tcp link have in common: a robot with an address of its own."""

    kind: Literal["udp", "tcp"]
    host: HostName = Field(description="The host at one end.")
    robot: RobotName = Field(description="The robot at the other.")
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


class Udp(IpLink):
    """A connection by UDP between a host and a robot with an address of its own."""

    kind: Literal["udp"] = Field(description="What kind of link this is.")


class Tcp(IpLink):
    """A connection by TCP between a host and a robot with an address of its own."""

    kind: Literal["tcp"] = Field(description="What kind of link this is.")


class Radio(Model):
    """A radio link between a Crazyradio dongle of a host and a Crazyflie."""

    kind: Literal["radio"] = Field(description="What kind of link this is.")
    host: HostName = Field(description="The host at one end.")
    robot: RobotName = Field(description="The robot at the other.")
    uri: RadioUri = Field(
        description="radio://DONGLE/CHANNEL/RATE/ADDRESS: the number of the dongle on its host, a channel "
        "from 0 to 125, the data rate (250K, 1M or 2M), and the Crazyflie's address, E7E7E7E7E7 by default."
    )

    @property
    def dongle(self) -> str:
        """The Crazyradio of its host, such as crazyradio0."""
        return f"crazyradio{self.uri.split('/')[2]}"

    @property
    def channel(self) -> int:
        """The channel, 1 MHz apart from the next."""
        return int(self.uri.split("/")[3])

    @property
    def rate(self) -> int:
        """Bits per second on the air."""
        return RADIO_RATES[self.uri.split("/")[4]]

    @property
    def address(self) -> str:
        """The address of the Crazyflie, ten hexadecimal digits."""
        return self.uri.split("/")[5]


RobotLink = Serial | Bluetooth | Udp | Tcp | Radio
Link = Annotated[Wlan | Ethernet | Serial | Bluetooth | Udp | Tcp | Radio, Field(discriminator="kind")]
LINKS: dict[str, type[Model]] = {
    "wlan": Wlan,
    "ethernet": Ethernet,
    "serial": Serial,
    "bluetooth": Bluetooth,
    "udp": Udp,
    "tcp": Tcp,
    "radio": Radio,
}
KINDS = tuple(LINKS)
