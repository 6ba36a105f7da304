"""Which robots the names and the drivers of a lab mean."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection, Mapping, Sequence
from typing import TypeGuard

from swarmctl.importing.draft import Value
from swarmctl.links.link_base import RobotLink
from swarmctl.plugins import LINK_KINDS
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.ros_packages.launch_files import (
    Setting,
)
from swarmctl.ros_packages.package import Package

# What people call robots of a type. A plural and two words with `_` or `-` between them count as well.
_CALLED: Mapping[str, str] = {
    "koala": "koala",
    **dict.fromkeys(("khepera3", "kheperaiii", "khepera", "k3"), "khepera3"),
    **dict.fromkeys(("epuck", "mepuck"), "epuck"),
    "epuck2": "epuck2",
}
_TWO_WORDS = re.compile(r"(?<=e)[_-](?=puck)|(?<=khepera)[_-](?=iii|3)|(?<=epuck)[_-](?=2)")
_OF_DRIVERS = re.compile("driver|node|base|serial|robots?|ros|py|cpp|controller|exe|bringup")
_OF_GROUPS = re.compile("robots?|hosts|pis")


def driven_type(package: str, executable: str, types: Collection[str]) -> str:
    """Returns the type of the robot that a node drives; empty if its names do not say so.

    All words of the executable, or of package and executable, name the robot or are words such as `driver`.
    """
    return _type_in(executable, _OF_DRIVERS, types) or _type_in(f"{package} {executable}", _OF_DRIVERS, types)


def type_of_group(group: str, types: Collection[str]) -> str:
    """Returns the type of the robots in a group of hosts called ``group``; empty if no type has its name."""
    return _type_in(group, _OF_GROUPS, types)


def _type_in(name: str, others: re.Pattern[str], types: Collection[str]) -> str:
    """The one type that a name has; empty if a word of it is neither a type's nor one of ``others``."""
    joined = _TWO_WORDS.sub("", name.lower())
    words = [one for one in re.split("[^a-z0-9]+", joined) if one and not others.fullmatch(one)]
    found = {_CALLED.get(one) or _CALLED.get(one.removesuffix("s"), "") for one in words}
    return next(iter(found)) if len(found) == 1 and found <= set(types) else ""


_MAC = re.compile("([0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2}")
_FIXED = ("/dev/ttyS", "/dev/ttyAMA", "/dev/serial0", "/dev/serial1")  # names that the kernel never changes
_BAUD = ("baud", "baudrate", "baud_rate")


def unknown_line(robot: str, host: str, robot_type: AnyRobotType | None, why: str = "") -> Value:
    """Returns the line of a robot as a place to fill in."""
    kind = robot_type.link.kinds[0] if robot_type and robot_type.link else "serial"
    line: type[RobotLink] = LINK_KINDS.get(kind)
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


def drivers_of(types: Mapping[str, AnyRobotType]) -> Mapping[tuple[str, str], Mapping[str, RosDriver]]:
    """Returns the drivers of robot types by package and launch file, then by type."""
    found: dict[tuple[str, str], dict[str, RosDriver]] = {}
    for name, kind in types.items():
        for one in kind.drivers if isinstance(kind, RosRobotType) else ():
            if one.launch:
                found.setdefault((one.package, posixpath.basename(one.launch)), {})[name] = one
    return found


def driver_files(packages: Mapping[str, Package], types: Mapping[str, AnyRobotType]) -> Mapping[str, str]:
    """Returns the packages of those launch files of a folder that are the driver of a robot type."""
    return {
        posixpath.normpath(posixpath.join(packages[name].folder, path)): name
        for name, file in drivers_of(types)
        if name in packages
        for path in packages[name].contents
        if posixpath.basename(path) == file
    }
