"""Bluetooth lines: the unit that pairs a robot by its PIN, and the one that binds its device."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.render import shipped_files
from swarmctl.render.bundle import ROOT, File, Part, Unit
from swarmctl.render.quoting import render
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Robot, Swarm

_PAIR = "bin/bluetooth-pair"
APART = 3  # s between robots, so that a host's first attempts do not meet


def parts(swarm: Swarm, host: Host) -> Iterator[Part]:
    """Yields the pairing script, and the units robot by robot."""
    lines = list(_lines(swarm, host))
    secrets = tuple(dict.fromkeys(line.pin for _, line in lines if line.pin is not None))
    script = File(_PAIR, shipped_files.text("os/bluetooth-pair"), 0o755)
    yield Part(files=(script,) if secrets else (), wants=_wants(lines), secrets=secrets)
    yield from _units(swarm, lines)


def _wants(lines: list[tuple[Robot, RfcommLine]]) -> dict[str, tuple[str, ...]]:
    robots = tuple(f"robots.{robot.name}" for robot, _ in lines)
    paired = tuple(f"robots.{robot.name}" for robot, line in lines if line.pin is not None)
    return {name: entries for name, entries in (("rfcomm", robots), ("bluetoothctl", paired)) if entries}


def _units(swarm: Swarm, lines: list[tuple[Robot, RfcommLine]]) -> Iterator[Part]:
    """Robot by robot: first the pairing, then the device."""
    for robot, line in lines:
        if line.pin is not None:
            yield _unit(swarm, robot, line, "pair", needs=(_PAIR,), secrets=(line.pin,))
        yield _unit(swarm, robot, line, "rfcomm")


def _lines(swarm: Swarm, host: Host) -> Iterator[tuple[Robot, RfcommLine]]:
    return ((one, one.line) for one in swarm.robots_on(host.name) if isinstance(one.line, RfcommLine))


def _unit(
    swarm: Swarm,
    robot: Robot,
    line: RfcommLine,
    kind: str,
    *,
    needs: tuple[str, ...] = (),
    secrets: tuple[str, ...] = (),
) -> Part:
    name = names.unit(swarm.name, robot.name, kind)
    values: dict[str, Any] = {
        "swarm": swarm.name,
        "home": f"{ROOT}/{swarm.name}",
        "target": names.target(swarm.name),
        "robot": robot.name,
        "line": line,
        "delay": APART * line.index,
        "again": 5 + APART * line.index,
        "workspaces": (),
    }
    file = File(f"units/{name}", render(f"{kind}.service", **values), origin=f"robots.{robot.name}")
    return Part((file,), (Unit(name, (file.path, *needs), secrets=secrets),))
