"""The line between a robot and its host, as far as a driver's parameters show it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swarmctl.importing.allowed_values import is_allowed, number
from swarmctl.importing.draft import Blank, Fact, Field
from swarmctl.links.link_base import Line
from swarmctl.plugins import LINK_KINDS
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.ros_packages.launched import Setting

_FIXED = ("/dev/ttyS", "/dev/ttyAMA", "/dev/serial0", "/dev/serial1")  # names that the kernel never changes
_BAUD = ("baud", "baudrate", "baud_rate")


def unknown_line(robot: str, host: str, robot_type: RobotType | None, why: str = "") -> Blank:
    """Returns the line of a robot as a place to fill in."""
    kind = robot_type.link.kinds[0] if robot_type else "serial"
    line: type[Line] = LINK_KINDS.get(kind)
    example: dict[str, object] = {"kind": kind, "host": host, "robot": robot, **line.unknown_end}
    return Blank(example, f"{why}; {line.where_to_find}" if why else line.where_to_find)


def line_of(robot: str, host: str, robot_type: RobotType | None, settings: Sequence[Setting]) -> Field:
    """Returns the line that the parameters of a driver name: a Bluetooth address or a fixed device."""
    known = {one.name: one for one in settings if one.value}
    kinds = robot_type.link.kinds if robot_type else ("serial", "bluetooth")
    for one in known.values():
        if one.value and "bluetooth" in kinds and is_allowed("mac", one.value):
            value: dict[str, object] = {
                "kind": "bluetooth",
                "host": host,
                "robot": robot,
                "mac": one.value.lower(),
            }
            return Fact(value, one.place)
    for one in known.values():
        if one.value and one.value.startswith("/dev/"):
            if one.value.startswith(_FIXED) and "serial" in kinds and is_allowed("device", one.value):
                value = {"kind": "serial", "host": host, "robot": robot, "device": one.value, **_baud(known)}
                return Fact(value, one.place)
            return unknown_line(robot, host, robot_type, f"{one.place} opens a device that may be renamed")
    return unknown_line(robot, host, robot_type)


def _baud(known: Mapping[str, Setting]) -> Mapping[str, object]:
    bauds = [number(known[key].value or "") for key in _BAUD if key in known]
    return {"baud": bauds[0]} if bauds and is_allowed("baud", bauds[0]) else {}
