"""The computer that a host is, and what is plugged in at its USB, as the kernel has them in sysfs(5)."""

from __future__ import annotations

import os

from . import files
from .named_tuple import NamedTuple
from .texts import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable

    Outside = Callable[[str], str]

_BOARD, _COMPUTER = "/proc/device-tree/model", "/sys/class/dmi/id"
_USB, _TTYS = "/sys/bus/usb/devices", "/sys/class/tty"
_HUB = "09"  # bDeviceClass
_MOST_DEVICES = 100


class UsbDevice(NamedTuple):
    """A USB device that is no hub. ``vendor`` and ``product``: its ids, in hexadecimal; ``name`` and
    ``serial``: as the device itself has them, empty without; ``ports``: its serial ports, such as
    ``/dev/ttyUSB0``."""

    vendor: str
    product: str
    name: str
    serial: str
    ports: list[str]


def model(outside: Outside) -> str:
    """Returns the model of the board, by its device tree, or of the computer, by its DMI; empty with neither.

    ``outside`` returns where a path of the host is read.
    """
    names = (_text(outside(f"{_COMPUTER}/{one}")) for one in ("sys_vendor", "product_name"))
    return _text(outside(_BOARD)) or " ".join(filter(None, names))


def usb_devices(outside: Outside) -> list[UsbDevice]:
    """Returns the USB devices but the hubs, in the order of their places."""
    ttys = {name: os.path.realpath(outside(f"{_TTYS}/{name}")) for name in _names(outside(_TTYS))}
    found: list[UsbDevice] = []
    for place in _names(outside(_USB)):
        folder = os.path.realpath(outside(f"{_USB}/{place}"))
        vendor, product, kind, serial, *names = (
            _text(f"{folder}/{one}")
            for one in ("idVendor", "idProduct", "bDeviceClass", "serial", "manufacturer", "product")
        )
        if vendor and kind != _HUB and len(found) < _MOST_DEVICES:
            ports = [f"/dev/{name}" for name, path in ttys.items() if path.startswith(folder + "/")]
            found.append(UsbDevice(vendor, product, " ".join(filter(None, names)), serial, ports))
    return found


def port(path: str, outside: Outside) -> str | None:
    """Returns the device to which a path of the host leads; None if there is none."""
    real = os.path.realpath(outside(path))
    return real[len(os.path.realpath(outside("/")).rstrip("/")) :] if os.path.exists(real) else None


def _names(folder: str) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except OSError:
        return []


def _text(path: str) -> str:
    """What a file of sysfs has; empty without it, or if its device has just gone."""
    try:
        content = files.read(path) or b""
    except OSError:
        return ""
    return clipped(content.strip(b"\0 \n"))
