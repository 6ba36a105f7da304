"""The device of a link identifies the robot, also after a reboot, and its port has the baud rate."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.links.link_base import Line
from swarmctl.links.serial_link import Serial, Usb
from swarmctl.linter.context import RuleContext, rule
from swarmctl.rules.serial_lines import BAUDS
from swarmctl.yamltext import edits

_NUMBERED = ("/dev/ttyUSB", "/dev/ttyACM")
_BY_ID = "/dev/serial/by-id/"
_RFCOMM = "/dev/rfcomm"
_CH340 = ("1a86", "7523")
# Chips with several ports and one serial number (usb.ids): how many ports, and what people call it.
_SEVERAL_PORTS = {
    ("0403", "6010"): (2, "an FT2232"),
    ("0403", "6011"): (4, "an FT4232H"),
    ("10c4", "ea70"): (2, "a CP2105"),
    ("10c4", "ea71"): (4, "a CP2108"),
}
INTERFACE = "(`udevadm info /dev/ttyUSB0` shows it as ID_USB_INTERFACE_NUM)"
_PORT = "(`udevadm info -a` shows it as KERNELS)"
_UDEVADM = "(`udevadm info -a` shows the serial number)"
_WAYS_TO_NAME_A_DEVICE = (
    f"usb: {{serial: ...}} for a USB adapter {_UDEVADM}",
    "device: /dev/ttyS0 for an on-board port",
)

# What `udevadm info -a` shows last is the USB controller: a PCI address, or its name on a board.
_CONTROLLER = re.compile(
    r"[0-9a-f]{4}:[0-9a-f]{2}:[0-9a-f]{2}\.[0-7]|[0-9a-f]{8}\.usb|.*(_hcd|-hcd|-hdrc)\..+", re.IGNORECASE
)
_BY_ID_NAME = re.compile(r"usb-.+_(?P<serial>[^_]+)-if[0-9a-f]{2}(-port[0-9]+)?")
_IDS = re.compile(r"[0-9a-fA-F]{4}:[0-9a-fA-F]{4}")
# CP210x leave the factory as 0001 (Silicon Labs AN721); clones repeat 0, 1 or a row of digits.
FACTORY = re.compile(r"0*[01]?|0*123456(78(9[0A]?)?)?|[fF]+")

_PLACEHOLDERS = ("00:00:00:00:00:00", "ff:ff:ff:ff:ff:ff")
_INQUIRY = re.compile(r"9e:8b:[0-3][0-9a-f]")  # lower address parts 9E8B00-9E8B3F (Bluetooth core, baseband)


@rule("LINK004")
def named_devices(context: RuleContext) -> Iterator[Diagnostic]:
    """A line without a device; a serial link with a USB adapter and a device, or an adapter of no name."""
    for index, link in context.lines:
        if isinstance(link, Line) and link.device_of(0, 1, "") is None:
            is_serial = isinstance(link, Serial)
            yield Diagnostic(
                "LINK004",
                f"the {link.title} link of `{link.robot}` has no device",
                context.span("links", index, "usb", "device"),
                label="needs `usb` or `device`" if is_serial else "",
                help=_WAYS_TO_NAME_A_DEVICE if is_serial else (),
            )
        elif not isinstance(link, Serial):
            continue
        elif link.usb is not None and not link.usb.identity:
            yield Diagnostic(
                "LINK004",
                f"`usb` of `{link.robot}` names no adapter",
                context.span("links", index, "usb", "serial"),
                label="needs `serial`, or `path` for an adapter that has none",
                help=(
                    f"usb: {{serial: ...}} {_UDEVADM}",
                    f"usb: {{path: 1-1.3}} for one without, such as a CH340, and keep its port {_PORT}",
                ),
            )
        elif link.usb is not None and link.device is not None:
            yield Diagnostic(
                "LINK004",
                f"the serial link of `{link.robot}` has both `usb` and `device`",
                context.span("links", index, "device"),
                help=("keep `usb`; the device is then /dev/swarm/" + link.robot,),
                fix=edits.make_fix(
                    "remove `device`", edits.remove(context.source, ("links", index, "device")), safe=False
                ),
            )


@rule("LINK005", "DEV001", "DEV002")
def unstable_devices(context: RuleContext) -> Iterator[Diagnostic]:
    """Devices that change their name, that other daemons open, or that are not bound."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.device is None or link.usb is not None:
            continue
        if link.device.startswith(_NUMBERED):
            yield Diagnostic(
                "LINK005",
                f"`{link.device}` may be another adapter after a reboot",
                context.span("links", index, "device"),
                label="numbered by plug-in order",
                help=(f"identify the adapter: usb: {{serial: ...}} {_UDEVADM}",),
            )
        elif link.device.startswith(_BY_ID):
            yield Diagnostic(
                "DEV001",
                f"other daemons may open `{link.device}` of robot `{link.robot}`",
                context.span("links", index, "device"),
                label="no udev rule of the swarm matches it",
                help=(
                    f"use usb: {{serial: ...}} {_UDEVADM}; its udev rule keeps ModemManager and brltty off",
                ),
            )
        elif link.device.startswith(_RFCOMM):
            yield Diagnostic(
                "DEV002",
                f"a serial link does not bind `{link.device}` of robot `{link.robot}`",
                context.span("links", index, "device"),
                label="exists only after `rfcomm bind`",
                help=(f'write {{kind: bluetooth, host: {link.host}, robot: {link.robot}, mac: "..."}}',),
            )


@rule("DEV003", "DEV004")
def usb_identities(context: RuleContext) -> Iterator[Diagnostic]:
    """A USB serial number that is invalid, or that many adapters or several ports have."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.usb is None:
            continue
        several = _SEVERAL_PORTS.get((link.usb.vendor or "", link.usb.product or ""))
        if several is not None and link.usb.interface is None and link.usb.identity:
            yield Diagnostic(
                "DEV004",
                f"`usb` of `{link.robot}` names {several[1]}, which has {several[0]} ports",
                context.span("links", index, "usb", "path" if link.usb.path else "serial"),
                label="the same for all of them",
                help=(f"add the port's number: `interface`, 0 to {several[0] - 1} {INTERFACE}",),
            )
        serial = link.usb.serial
        if serial is None:
            continue
        if serial.isalnum():  # what the next two are not
            yield from _shared_or_absent(context, index, link.usb, serial) if link.usb.path is None else ()
        elif _CONTROLLER.fullmatch(serial) or _IDS.fullmatch(serial):
            whole = _CONTROLLER.fullmatch(serial) is not None
            yield Diagnostic(
                "DEV003",
                f"`{serial}` is not the serial number of a USB adapter",
                context.span("links", index, "usb", "serial"),
                label="the USB controller's; it matches every adapter" if whole else "vendor and product id",
                help=(
                    "use the ATTRS{serial} next to the adapter's own ATTRS{idVendor}"
                    if whole
                    else f'usb: {{serial: ..., vendor: "{serial[:4]}", product: "{serial[5:]}"}} {_UDEVADM}',
                ),
            )
        elif found := _BY_ID_NAME.fullmatch(serial):
            yield Diagnostic(
                "DEV003",
                f"`{serial}` is not the serial number of a USB adapter",
                context.span("links", index, "usb", "serial"),
                label="its name in /dev/serial/by-id",
                help=(
                    f"the number is probably its last part: usb: {{serial: {found['serial']}}} {_UDEVADM}",
                ),
                fix=edits.make_fix(
                    f"write `{found['serial']}`",
                    edits.replace_value(context.source, ("links", index, "usb", "serial"), found["serial"]),
                    safe=False,
                ),
            )
        elif link.usb.path is None:
            yield from _shared_or_absent(context, index, link.usb, serial)


def _shared_or_absent(context: RuleContext, index: int, usb: Usb, serial: str) -> Iterator[Diagnostic]:
    """Serial numbers of chips that leave the factory all with the same one, or with none."""
    if (usb.vendor, usb.product) == _CH340:
        yield Diagnostic(
            "DEV004",
            "most adapters with a CH340 (1a86:7523) have no serial number",
            context.span("links", index, "usb", "serial"),
            label="then no adapter matches it",
            help=(
                f"name the USB port, and keep it: usb: {{path: 1-1.3}} {_PORT}",
                "ignore this if `udevadm info -a` shows the number next to the adapter's ATTRS{idVendor}",
            ),
        )
    elif usb.vendor is None and usb.product is None and FACTORY.fullmatch(serial):
        yield Diagnostic(
            "DEV004",
            f"many cheap adapters have the serial number `{serial}`",
            context.span("links", index, "usb", "serial"),
            label="factory default",
            help=(
                "add `vendor` and `product` (`lsusb` shows them), so that only this model matches",
                f"for two adapters of one model, name the USB ports: usb: {{path: 1-1.3}} {_PORT}",
            ),
        )


@rule("DEV005")
def bluetooth_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """An invalid Bluetooth address."""
    for index, link in context.lines:
        if not isinstance(link, Bluetooth):
            continue
        if link.mac in _PLACEHOLDERS or _INQUIRY.fullmatch(link.mac[9:]):
            yield Diagnostic(
                "DEV005",
                f"invalid Bluetooth address `{link.mac}`",
                context.span("links", index, "mac"),
                label="all zeros or all ones" if link.mac in _PLACEHOLDERS else "reserved for inquiries",
                notes=(Note(context.span("robots", link.robot, key=True), "the robot"),),
                help=("switch the robot on; `bluetoothctl scan on` shows its address",),
            )


@rule("DEV007")
def agreed_rates(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate that the robot type does not support. LINE004 reports non-standard rates."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.baud is None or link.baud not in BAUDS:
            continue
        type_name = context.spec.robots[link.robot].type
        known = context.bauds_of(link.robot)
        if known and link.baud not in known:
            rates = " or ".join(map(str, known))
            yield Diagnostic(
                "DEV007",
                f"robot `{link.robot}` (type `{type_name}`) supports {rates} baud, not {link.baud}",
                context.span("links", index, "baud"),
                label="both sides need the same rate",
                notes=(Note(context.span("robots", link.robot, "type"), "the robot's type"),),
                help=(f"leave `baud` out to use the type's rate, {known[0]}",),
                fix=edits.make_fix(
                    "remove `baud`",
                    edits.remove(context.document.source, ("links", index, "baud")),
                    safe=False,
                ),
            )


_BOARD_PORTS = ("/dev/ttyS0", "/dev/ttyAMA0", "/dev/serial0")
_BOARD_LIMIT = 460800  # rosserial#552: 921600 fails on the UART of a Raspberry Pi 3
# Their firmware connects ttyAMA0 with the Bluetooth chip; a Raspberry Pi 2 has none, a 5 another UART for it.
_BLUETOOTH_ON_PL011 = ("raspberry-pi-3", "raspberry-pi-4", "raspberry-pi-zero-2w", "raspberry-pi-zero-w")


@rule("DEV008")
def board_ports(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate at which the UART of a Raspberry Pi loses bytes."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.device not in _BOARD_PORTS:
            continue
        baud = context.baud_of(link) or 0
        computer = context.computer_of(link.host) or ""
        if baud > _BOARD_LIMIT and computer.startswith("raspberry-pi"):
            yield Diagnostic(
                "DEV008",
                f"`{link.device}` of a {computer} loses bytes at {baud} baud",
                context.span("links", index, "baud" if link.baud else "device"),
                label=f"reliable up to {_BOARD_LIMIT}",
                notes=(Note(context.span("hosts", link.host, key=True), "this computer"),),
                help=("use a USB adapter, or a lower baud rate on both sides",),
            )


@rule("DEV009")
def ports_of_bluetooth(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot on the UART that serves the Bluetooth of a Raspberry Pi."""
    for index, link in context.lines:
        if (
            not isinstance(link, Serial)
            or link.device != "/dev/ttyAMA0"
            or link.host not in context.spec.hosts
        ):
            continue
        computer, host = context.computer_of(link.host) or "", context.spec.hosts[link.host]
        if host.bluetooth and computer.startswith(_BLUETOOTH_ON_PL011):
            yield Diagnostic(
                "DEV009",
                f"`/dev/ttyAMA0` of a {computer} is the port of its Bluetooth, which host `{link.host}` uses",
                context.span("links", index, "device"),
                label="not wired to the pins",
                notes=(Note(context.span("hosts", link.host, "bluetooth"), "its Bluetooth adapters"),),
                help=(
                    "write `/dev/serial0`, with enable_uart=1 in config.txt, or use a USB adapter",
                    "ignore this if config.txt has dtoverlay=miniuart-bt, or if Bluetooth is a USB dongle",
                ),
            )
