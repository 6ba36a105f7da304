"""The files that begin a new swarm or a robot type of the user."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import groupby
from typing import Any, TypeVar

from swarmctl.field_types import LAST_DONGLE
from swarmctl.plugins import LINK_KINDS, MIDDLEWARES
from swarmctl.render import shipped_files
from swarmctl.render.quoting import render
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.model import Mode
from swarmctl.swarm.modes import ROLES
from swarmctl.yamltext.hostlist import ranges_of

BASE = "laptop"
_NETWORK = "192.168.77"
_FIRST = 10
_LAST_NUMBERS = re.compile(r"[0-9]+(?=[^0-9']*')")  # of the texts in a repr


@dataclass(frozen=True)
class _Host:
    name: str
    address: str
    computer: str
    bluetooth: bool


@dataclass(frozen=True)
class _Robot:
    name: str
    type: str
    host: str
    kind: str
    line: str
    local_ports: tuple[int, ...] = ()  # where those of the type are taken by another robot of the host


@dataclass(frozen=True)
class _Island:
    name: str
    hub: str
    hosts: Sequence[str]


_Entry = TypeVar("_Entry", _Host, _Robot)


def starting_spec(name: str, mode: Mode, robots: Mapping[str, str], types: Mapping[str, AnyRobotType]) -> str:
    """Returns the text of a first spec with ``robots``, name to type. Serial numbers are placeholders."""
    placed = [
        _placed(number, robot, kind, types[kind], mode)
        for number, (robot, kind) in enumerate(robots.items(), 1)
    ]
    placed = [_apart(robot, placed[:number], types[robot.type]) for number, robot in enumerate(placed)]
    hosts = _hosts(placed)
    islands = _islands([host.name for host in hosts]) if mode is Mode.COMBINED else []
    distro = _distro([types[one] for one in robots.values()])
    text = render(
        "swarm.yaml",
        name=name,
        distro=distro,
        names_its_distro=distro != MIDDLEWARES.default,
        driven=[one for one in _in_ranges(placed) if _takes_velocities(types[one.type], distro)],
        mode=mode.value,
        role=ROLES[mode].key if mode in ROLES else None,
        base=BASE,
        hosts=_in_ranges(hosts),
        robots=_in_ranges(placed),
        islands=islands,
    )
    return text.decode()


def _distro(types: Sequence[AnyRobotType]) -> str:
    """Returns the first distribution for which all ROS packages among the drivers exist; else the default."""
    drivers = [one.drivers for one in types if isinstance(one, RosRobotType)]
    names = (one for one in MIDDLEWARES if all(any(each.is_for(one) for each in of) for of in drivers))
    return next(names, MIDDLEWARES.default)


def _takes_velocities(robot_type: AnyRobotType, distro: str) -> bool:
    return not isinstance(robot_type, RosRobotType) or not robot_type.driver_of(distro).ungated


def _placed(number: int, robot: str, type_name: str, robot_type: AnyRobotType, mode: Mode) -> _Robot:
    host = BASE if mode is Mode.SINGLE_MINDED else f"{robot}-pi"
    kind = robot_type.link.kinds[0] if robot_type.link is not None else ""
    dongle = (number - 1) % (LAST_DONGLE + 1) if host == BASE else 0
    end = LINK_KINDS.get(kind).first_value(number, robot, dongle) if kind else ""
    return _Robot(robot, type_name, host, kind, end)


def _apart(robot: _Robot, earlier: Sequence[_Robot], robot_type: AnyRobotType) -> _Robot:
    """The robot with ports of its own, if its host drives others of its type already."""
    equal = sum((one.host, one.type) == (robot.host, robot.type) for one in earlier)
    usual = robot_type.link.local_ports if isinstance(robot_type, RosRobotType) and robot_type.link else ()
    if not equal or not robot.kind or "local_ports" not in LINK_KINDS.get(robot.kind).type_keys:
        return robot
    return replace(robot, local_ports=tuple(port + 10 * equal for port in usual))


def _hosts(robots: Sequence[_Robot]) -> list[_Host]:
    speaking = {robot.host for robot in robots if robot.kind == "bluetooth"}
    names = dict.fromkeys([BASE, *(robot.host for robot in robots)])
    return [
        _Host(name, f"{_NETWORK}.{number}", "laptop" if name == BASE else "raspberry-pi-4b", name in speaking)
        for number, name in enumerate(names, _FIRST)
    ]


def _in_ranges(entries: Sequence[_Entry]) -> list[_Entry]:
    """Equal entries as one, each value that differs as a range: ``k3-[1-3]`` on ``k3-[1-3]-pi``."""
    written: list[_Entry] = []
    for _, alike in groupby(entries, key=lambda one: _LAST_NUMBERS.sub("", repr(one))):
        run = list(alike)
        joined = {key: _joined([getattr(one, key) for one in run]) for key in asdict(run[0])}
        written += run if None in joined.values() else [replace(run[0], **joined)]
    return written


def _joined(values: Sequence[Any]) -> Any:
    """Returns what all ``values`` are, or the one range that they make; None if they make none."""
    if len(set(values)) == 1:
        return values[0]
    ranges = ranges_of(map(str, values))
    return ranges[0][0] if len(ranges) == 1 else None


def _islands(hosts: Sequence[str]) -> list[_Island]:
    """The last robot's host is alone, the others are together."""
    return [
        _Island(name, part[0], [text for text, _ in ranges_of(part)])
        for name, part in (("home", hosts[:-1]), ("away", hosts[-1:]))
    ]


def type_text(name: str, protocol: str, *, schema: bool) -> str:
    """Returns the text of robots/NAME.yaml, with empty values where only the user knows the robot.

    ``protocol`` is a protocol kind. With ``schema`` the file refers editors to the schema in ``.swarmctl``.
    """
    values = {"title": _title(name), "protocol": protocol, "codec": class_name(name), "schema": schema}
    return render("robot.yaml", **values).decode()


def ros_type_text(name: str, package: str, file: str, *, schema: bool) -> str:
    """Returns the text of robots/NAME.yaml for a robot whose driver is ``file``, an executable or launch file
    of a ROS package."""
    kind = "launch" if file.endswith((".launch", ".launch.xml")) else "executable"
    values = {"name": name, "title": _title(name), "package": package, "kind": kind, "file": file}
    return render("ros_robot.yaml", **values, schema=schema).decode()


def codec_text(name: str) -> str:
    """Returns the text of robots/NAME.py: a complete codec for comma-separated lines of text."""
    return shipped_files.text("project/codec.py").decode().replace("OwnCodec", class_name(name))


def class_name(name: str) -> str:
    """Returns the name of the codec class of a robot type, such as ``BeetleCodec`` for ``beetle``."""
    words = name.replace(".", "-").split("-")
    return "".join(word.capitalize() for word in words) + "Codec"


def _title(name: str) -> str:
    return name.replace("-", " ").capitalize()
