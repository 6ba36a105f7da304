"""Bluetooth lines: the unit that pairs a robot, with its PIN, and the one that binds its device."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarmctl.render import shipped
from swarmctl.render.bundle import ROOT, File, Unit
from swarmctl.render.templates import render
from swarmctl.topology import names
from swarmctl.topology.swarm import Host, RfcommLine, Robot, Swarm

_PAIR = "bin/bluetooth-pair"
APART = 3  # s between robots, so that a host's first attempts do not meet


def files(swarm: Swarm, host: Host) -> Iterator[File]:
    """What the units run, the units aside."""
    if secrets(swarm, host):
        yield File(_PAIR, shipped.text("host/bluetooth-pair"), 0o755)


def units(swarm: Swarm, host: Host) -> Iterator[tuple[File, Unit]]:
    """Robot by robot: first the pairing, then the device."""
    for robot, line in _lines(swarm, host):
        if line.pin is not None:
            yield _unit(swarm, robot, line, "pair", needs=(_PAIR,), secret=line.pin)
        yield _unit(swarm, robot, line, "rfcomm")


def wants(swarm: Swarm, host: Host) -> tuple[str, ...]:
    bound = ("rfcomm",) if any(_lines(swarm, host)) else ()
    return (*bound, "bluetoothctl") if secrets(swarm, host) else bound


def secrets(swarm: Swarm, host: Host) -> tuple[str, ...]:
    """The names of the PINs that the host must know."""
    return tuple(dict.fromkeys(line.pin for _, line in _lines(swarm, host) if line.pin is not None))


def _lines(swarm: Swarm, host: Host) -> Iterator[tuple[Robot, RfcommLine]]:
    return ((one, one.line) for one in swarm.robots_on(host.name) if isinstance(one.line, RfcommLine))


def _unit(
    swarm: Swarm, robot: Robot, line: RfcommLine, kind: str, *, needs: tuple[str, ...] = (), secret: str = ""
) -> tuple[File, Unit]:
    name = names.unit(swarm.name, robot.name, kind)
    values: dict[str, Any] = {
        "swarm": swarm.name,
        "home": f"{ROOT}/{swarm.name}",
        "target": names.target(swarm.name),
        "robot": robot.name,
        "line": line,
        "delay": APART * line.index,
        "again": 5 + APART * line.index,
        "workspace": None,
    }
    file = File(f"units/{name}", render(f"{kind}.service", **values), origin=f"robots.{robot.name}")
    return file, Unit(name, (file.path, *needs), secret=secret)
