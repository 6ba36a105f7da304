"""A serial line between a host and a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from swarmctl.field_types import Baud, DevicePath, HexId, Model, SystemId, UsbPort, UsbText
from swarmctl.links.link_base import Delay, Device, Ends, Line

FTDI = "0403"  # vendor id of Future Technology Devices International (usb.ids)


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
    interface: Annotated[int, Field(ge=0, le=255)] | None = Field(
        None,
        examples=[1],
        description="Which port of an adapter with several, such as an FT4232H: its USB interface "
        "(`udevadm info /dev/ttyUSB0`, ID_USB_INTERFACE_NUM, which is hexadecimal).",
    )
    vendor: HexId | None = Field(None, description="Vendor id, four hexadecimal digits.")
    product: HexId | None = Field(None, description="Product id, four hexadecimal digits.")

    @property
    def identity(self) -> str:
        """What distinguishes the adapter from others of its model on a host."""
        return self.path or self.serial or ""


@dataclass(frozen=True)
class UsbLine:
    """A serial line through a USB adapter that is identified by its vendor, product or serial number."""

    usb: Usb
    path: str

    @property
    def title(self) -> str:
        port = f"interface {self.usb.interface} of " if self.usb.interface is not None else ""
        if self.usb.path:
            return f"{port}the USB adapter in port {self.usb.path}"
        return f"{port}the USB adapter with serial number {self.usb.serial}"


@dataclass(frozen=True)
class FixedLine:
    """A serial line on a device with a fixed path."""

    path: str
    title: str = "the serial port"


class Serial(Line):
    """A serial line between a host and a robot: a USB adapter by its identity, or a fixed device."""

    wired: ClassVar[bool] = True
    device_keys: ClassVar[tuple[str, ...]] = ("usb", "device", "baud", "system_id")
    type_keys: ClassVar[tuple[str, ...]] = ("baud",)
    title: ClassVar[str] = "serial"
    placeholders: ClassVar[Mapping[str, str]] = {
        "device": "the device of its {} link",
        "baud": "bits per second of its {} link",
        "system_id": "the vehicle's MAVLink system id, of its {} link",
        "uri": "its link as a URI: {}",
    }
    example: ClassVar[str] = "usb: {serial: ...}"
    # An FTDI adapter forwards its buffer when its latency timer expires (AN232B-04): 16 ms, or the 1 ms that
    # our udev rule sets, and a USB frame of 1 ms. An unknown adapter counts as one with its default timer;
    # none is faster than such a frame.
    delays: ClassVar[Mapping[str, Delay]] = {
        "usb": Delay(0.016, 0.001), "usb-ftdi": Delay(0.002, 0.001), "uart": Delay(0.002, 0.0),
    }  # fmt: skip
    unknown_end: ClassVar[Mapping[str, Any]] = {"usb": {"serial": "FTDI1234"}}
    where_to_find: ClassVar[str] = (
        "the serial number of its adapter, ATTRS{serial} of `udevadm info -a DEVICE`"
    )

    kind: Literal["serial"] = Field(description="What kind of link this is.")
    usb: Usb | None = Field(None, description="The USB adapter; the device is then /dev/swarm/<robot>.")
    device: DevicePath | None = Field(
        None, description="A device that never changes its name, such as /dev/ttyS0."
    )
    baud: Baud | None = Field(None, description="Bits per second; the robot type's own by default.")

    system_id: SystemId = 1

    @classmethod
    def first_value(cls, number: int, robot: str, dongle: int) -> str:
        return f"SERIAL-OF-{robot.upper()}"

    @property
    def own_baud(self) -> int | None:
        return self.baud

    @property
    def line_kind(self) -> str:
        if self.usb is None:
            return "uart"
        return "usb-ftdi" if self.usb.vendor == FTDI else "usb"

    def label(self, adapter: str | None, port: int | None) -> str:
        return self.device or "usb"

    def values(self, ends: Ends) -> dict[str, str | int]:
        return {**super().values(ends), "system_id": self.system_id}

    def device_of(self, number: int, channel: int, adapter: str) -> Device | None:
        if self.usb is not None:
            return UsbLine(self.usb, f"/dev/swarm/{self.robot}")  # the path that a udev rule gives it
        return FixedLine(self.device) if self.device is not None else None
