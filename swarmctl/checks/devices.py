"""The device at the host's end of a line is the robot's own, today and after the next boot."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.model import Bluetooth, Serial, Usb

_NUMBERED = ("/dev/ttyUSB", "/dev/ttyACM")
_BY_ID = "/dev/serial/by-id/"
_RFCOMM = "/dev/rfcomm"
_UDEVADM = "(`udevadm info -a` shows the serial number)"

# What `udevadm info -a` shows last is the USB controller: a PCI address, or its name on a board.
_CONTROLLER = re.compile(
    r"[0-9a-f]{4}:[0-9a-f]{2}:[0-9a-f]{2}\.[0-7]|[0-9a-f]{8}\.usb|.*(_hcd|-hcd|-hdrc)\..+", re.IGNORECASE
)
_IDS = re.compile(r"[0-9a-fA-F]{4}:[0-9a-fA-F]{4}")
# CP210x leave the factory as 0001 (Silicon Labs AN721); clones repeat 0, 1 or a row of digits.
_FACTORY = re.compile(r"0*[01]?|0*123456(78(9[0A]?)?)?|[fF]+")

_NOBODY = ("00:00:00:00:00:00", "ff:ff:ff:ff:ff:ff")
_INQUIRY = re.compile(r"9e:8b:[0-3][0-9a-f]")  # lower address parts 9E8B00-9E8B3F (Bluetooth core, baseband)
_IN_EXAMPLES = {
    "00:11:22:33:44:55",
    "01:23:45:67:89:ab",
    "11:22:33:44:55:66",
    "12:34:56:78:9a:bc",
    "aa:bb:cc:dd:ee:ff",
}


def named_devices(case: Case) -> Iterator[Diagnostic]:
    """LINK004: a serial line has a USB adapter or a device of its own, not both."""
    for index, link in case.lines:
        if not isinstance(link, Serial):
            continue
        if link.usb is None and link.device is None:
            yield Diagnostic(
                "LINK004",
                f"the serial line of `{link.robot}` names no device",
                case.span("links", index),
                label="needs `usb` or `device`",
                help=(
                    f"usb: {{serial: ...}} for a USB adapter {_UDEVADM}",
                    "device: /dev/ttyS0 for a port of the board itself",
                ),
            )
        elif link.usb is not None and link.device is not None:
            yield Diagnostic(
                "LINK004",
                f"the serial line of `{link.robot}` names two devices",
                case.span("links", index, "device"),
                help=("keep `usb`; the device is then called /dev/swarm/" + link.robot,),
            )


def lasting_devices(case: Case) -> Iterator[Diagnostic]:
    """LINK005, DEV001, DEV002: devices that are renamed, that others touch, that nobody makes."""
    for index, link in case.lines:
        if not isinstance(link, Serial) or link.device is None or link.usb is not None:
            continue
        if link.device.startswith(_NUMBERED):
            yield Diagnostic(
                "LINK005",
                f"`{link.device}` may be another adapter after the next boot",
                case.span("links", index, "device"),
                label="numbered in the order of plugging in",
                help=(f"name the adapter itself: usb: {{serial: ...}} {_UDEVADM}",),
            )
        elif link.device.startswith(_BY_ID):
            yield Diagnostic(
                "DEV001",
                f"other programs may talk to `{link.robot}` at `{link.device}`",
                case.span("links", index, "device"),
                severity=Severity.WARNING,
                label="no udev rule of the swarm is about it",
                help=(f"usb: {{serial: ...}} instead {_UDEVADM}; modem and braille daemons then keep off",),
            )
        elif link.device.startswith(_RFCOMM):
            yield Diagnostic(
                "DEV002",
                f"`{link.device}` of `{link.robot}` belongs to whoever binds it; a serial link does not",
                case.span("links", index, "device"),
                label="made by `rfcomm bind`",
                help=(f'write {{kind: bluetooth, host: {link.host}, robot: {link.robot}, mac: "..."}}',),
            )


def usb_identities(case: Case) -> Iterator[Diagnostic]:
    """DEV003, DEV004: a serial number that is none, or that many adapters have."""
    for index, link in case.lines:
        if not isinstance(link, Serial) or link.usb is None:
            continue
        serial = link.usb.serial
        if _CONTROLLER.fullmatch(serial) or _IDS.fullmatch(serial):
            whole = _CONTROLLER.fullmatch(serial) is not None
            yield Diagnostic(
                "DEV003",
                f"`{serial}` is no serial number of an adapter",
                case.span("links", index, "usb", "serial"),
                label="the USB controller's: it fits every adapter" if whole else "vendor and product",
                help=(
                    "take the ATTRS{serial} that stands beside the adapter's own ATTRS{idVendor}"
                    if whole
                    else f'usb: {{serial: ..., vendor: "{serial[:4]}", product: "{serial[5:]}"}} {_UDEVADM}',
                ),
            )
        elif link.usb.vendor is None and link.usb.product is None and _FACTORY.fullmatch(serial):
            yield from _factory_serial(case, index, link.usb)


def _factory_serial(case: Case, index: int, usb: Usb) -> Iterator[Diagnostic]:
    yield Diagnostic(
        "DEV004",
        f"many cheap adapters have the serial number `{usb.serial}`",
        case.span("links", index, "usb", "serial"),
        severity=Severity.WARNING,
        label="set at the factory",
        help=(
            "add `vendor` and `product` (`lsusb` shows them), so that only this kind of adapter fits",
            "with two adapters of one kind: device: /dev/serial/by-path/..., and never change the socket",
        ),
    )


def bluetooth_addresses(case: Case) -> Iterator[Diagnostic]:
    """DEV005, DEV006: an address that no robot has, or that stands in every manual."""
    for index, link in case.lines:
        if not isinstance(link, Bluetooth):
            continue
        if link.mac in _NOBODY or _INQUIRY.fullmatch(link.mac[9:]):
            yield Diagnostic(
                "DEV005",
                f"no robot has the Bluetooth address `{link.mac}`",
                case.span("links", index, "mac"),
                label="nobody's" if link.mac in _NOBODY else "reserved for inquiries",
                notes=(Note(case.span("robots", link.robot, key=True), "the robot"),),
                help=("switch the robot on; `bluetoothctl scan on` shows its address",),
            )
        elif link.mac in _IN_EXAMPLES or int(link.mac[:2], 16) & 1:
            group = link.mac not in _IN_EXAMPLES
            yield Diagnostic(
                "DEV006",
                f"`{link.mac}` does not look like the Bluetooth address of a robot",
                case.span("links", index, "mac"),
                severity=Severity.WARNING,
                label="a group's: the first byte is odd" if group else "an example in many manuals",
                notes=(Note(case.span("robots", link.robot, key=True), "the robot"),),
                help=("compare it with the robot's label, or with what `bluetoothctl scan on` shows",),
            )


RULES: tuple[Rule, ...] = (named_devices, lasting_devices, usb_identities, bluetooth_addresses)
