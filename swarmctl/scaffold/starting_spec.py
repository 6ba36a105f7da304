"""A first spec for a new swarm: one base computer, and a small computer for each robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from swarmctl.render.quoting import render
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.model import Mode
from swarmctl.swarm.modes import ROLES

BASE = "laptop"
_NETWORK = "192.168.77"
_FIRST = 10


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


@dataclass(frozen=True)
class _Island:
    name: str
    hosts: Sequence[str]


def starting_spec(name: str, mode: Mode, robots: Mapping[str, str], types: Mapping[str, RobotType]) -> str:
    """Returns the text of a first spec with ``robots``, name to type. Serial numbers are placeholders."""
    placed = [
        _placed(number, robot, kind, types[kind], mode)
        for number, (robot, kind) in enumerate(robots.items(), 1)
    ]
    hosts = _hosts(placed)
    text = render(
        "swarm.yaml",
        name=name,
        mode=mode.value,
        role=ROLES[mode].key if mode in ROLES else None,
        base=BASE,
        hosts=hosts,
        robots=placed,
        islands=_islands([host.name for host in hosts]) if mode is Mode.COMBINED else [],
    )
    return text.decode()


def _placed(number: int, robot: str, type_name: str, robot_type: RobotType, mode: Mode) -> _Robot:
    host = BASE if mode is Mode.SINGLE_MINDED else f"{robot}-pi"
    kind = robot_type.link.kinds[0]
    line = f"10:00:E8:00:00:{number:02X}" if kind == "bluetooth" else f"SERIAL-OF-{robot.upper()}"
    return _Robot(robot, type_name, host, kind, line)


def _hosts(robots: Sequence[_Robot]) -> list[_Host]:
    speaking = {robot.host for robot in robots if robot.kind == "bluetooth"}
    names = dict.fromkeys([BASE, *(robot.host for robot in robots)])
    return [
        _Host(name, f"{_NETWORK}.{number}", "laptop" if name == BASE else "raspberry-pi-4b", name in speaking)
        for number, name in enumerate(names, _FIRST)
    ]


def _islands(hosts: Sequence[str]) -> list[_Island]:
    """The last robot's host roams alone, the others stay together."""
    return [_Island("home", hosts[:-1]), _Island("away", hosts[-1:])]
