"""A lab as text: its hosts and networks, and the poses of its robots."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.yamltext import hostlist

_SPEEDS = ("left", "right", "v", "omega")
_STYLE = {"running": "green", "starting": "yellow", "stopped": "red"}


def hosts(status: Mapping[str, Any], *, details: bool = False) -> Table:
    """One row per host: state, address, number of boots, networks; one for more than a few equal hosts."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("HOST", "STATE", "ADDRESS", "USER", "BOOTS", "NETWORKS"):
        table.add_column(title)
    rows = [(host, _cables(status, host["name"])) for host in status["hosts"]]
    groups = grouped(
        rows,
        lambda row: (*(row[0][key] for key in ("state", "user", "boots")), row[1].plain),
        alone=lambda group: details or len(group) <= FEW,
    )
    for group in groups:
        host, cables = group[0]
        names, addresses = (hostlist.written(one[key] for one, _ in group) for key in ("name", "address"))
        state = Text(host["state"], _STYLE.get(host["state"], ""))
        table.add_row(names, state, addresses, host["user"], str(host["boots"]), cables)
    return table


def _cables(status: Mapping[str, Any], host: str) -> Text:
    return Text(", ").join(_cable(one, host) for one in status["networks"] if host in one["hosts"])


def _cable(network: Mapping[str, Any], host: str) -> Text:
    return Text(network["name"]) if network["hosts"][host] else Text(f"{network['name']} (cut)", "red")


def robots(found: Mapping[str, Mapping[str, Any]]) -> Group:
    """One row per robot: true pose (m, degrees), true wheel speeds (m/s), whether it moves.

    Above the rows of many robots stands how many move, below them the failures of users' own emulators.
    """
    moving = sum(any(robot.get(key) for key in _SPEEDS) for robot in found.values())
    summary = Text(f"{len(found)} robots, {moving} of them move") if len(found) > FEW else None
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("ROBOT")
    for title in ("X m", "Y m", "HEADING°", "LEFT m/s", "RIGHT m/s"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("STATE", no_wrap=True)
    for name, robot in found.items():
        state = Text("moves", "green") if any(robot.get(key) for key in _SPEEDS) else Text("stands still")
        if robot.get("failure"):
            state = Text("emulator failed", "red")
        table.add_row(
            name, f"{robot['x']:.3f}", f"{robot['y']:.3f}", f"{_heading(robot['theta']):.1f}",
            f"{robot['left']:.3f}", f"{robot['right']:.3f}",
            state if robot["plugged"] else state.append(", cable disconnected", "red"),
        )  # fmt: skip
    failures = [f"{name}: {robot['failure']}" for name, robot in found.items() if robot.get("failure")]
    return Group(*([summary] if summary else []), table, *(Text(failure, "red") for failure in failures))


def _heading(theta: float) -> float:
    """Degrees in (-180, 180]; counter-clockwise from ahead (REP-103)."""
    degrees = math.degrees(theta) % 360
    return degrees - 360 if degrees > 180 else degrees
