"""The line between a robot and its host, as far as a driver's parameters show it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TypeGuard

from swarmctl.importing.draft import Value
from swarmctl.links.link_base import Line
from swarmctl.plugins import LINK_KINDS
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.ros_packages.launched import Setting

_MAC = re.compile("([0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2}")
_FIXED = ("/dev/ttyS", "/dev/ttyAMA", "/dev/serial0", "/dev/serial1")  # names that the kernel never changes
_BAUD = ("baud", "baudrate", "baud_rate")


def unknown_line(robot: str, host: str, robot_type: RobotType | None, why: str = "") -> Value:
    """Returns the line of a robot as a place to fill in."""
    kind = robot_type.link.kinds[0] if robot_type else "serial"
    line: type[Line] = LINK_KINDS.get(kind)
    example = {"kind": kind, "host": host, "robot": robot, **line.unknown_end}
    return Value(example, fill_in=f"{why}; {line.where_to_find}" if why else line.where_to_find)


def line_of(robot: str, host: str, robot_type: RobotType, settings: Sequence[Setting]) -> Value:
    """Returns the line that the parameters of a driver name: a Bluetooth address or a fixed device."""
    ends = {"host": host, "robot": robot}
    kinds = robot_type.link.kinds
    for one in settings:
        value = one.value or ""
        if "bluetooth" in kinds and _MAC.fullmatch(value):
            return Value({"kind": "bluetooth", **ends, "mac": value.lower()}, one.place)
        if "serial" in kinds and value.startswith(_FIXED):
            bauds = [int(baud.value) for baud in settings if baud.name in _BAUD and _is_number(baud.value)]
            baud = {"baud": bauds[0]} if bauds else {}
            return Value({"kind": "serial", **ends, "device": value, **baud}, one.place)
        if value.startswith("/dev/"):
            return unknown_line(robot, host, robot_type, f"{one.place} opens a device that may be renamed")
    return unknown_line(robot, host, robot_type)


def _is_number(text: str | None) -> TypeGuard[str]:
    return bool(re.fullmatch("[0-9]{1,9}", text or "", re.ASCII))
