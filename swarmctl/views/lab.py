"""A lab as text: its hosts and networks, and the poses of its robots."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

_STYLE = {"running": "green", "starting": "yellow", "stopped": "red"}


def hosts(status: Mapping[str, Any]) -> Table:
    """One row per host: state, address, number of boots, networks."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("HOST", "STATE", "ADDRESS", "USER", "BOOTS", "NETWORKS"):
        table.add_column(title)
    for host in status["hosts"]:
        cables = [_cable(one, host["name"]) for one in status["networks"] if host["name"] in one["hosts"]]
        table.add_row(
            host["name"], Text(host["state"], _STYLE.get(host["state"], "")), host["address"],
            host["user"], str(host["boots"]), Text(", ").join(cables),
        )  # fmt: skip
    return table


def _cable(network: Mapping[str, Any], host: str) -> Text:
    return Text(network["name"]) if network["hosts"][host] else Text(f"{network['name']} (cut)", "red")


def robots(found: Mapping[str, Mapping[str, Any]]) -> Group:
    """One row per robot: true pose (m, degrees), true wheel speeds (m/s), whether it moves.

    Below the table are the failures of users' own emulators.
    """
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("ROBOT")
    for title in ("X m", "Y m", "HEADING°", "LEFT m/s", "RIGHT m/s"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("STATE", no_wrap=True)
    for name, robot in found.items():
        state = Text("moves", "green") if robot["left"] or robot["right"] else Text("stands still")
        if robot.get("failure"):
            state = Text("emulator failed", "red")
        table.add_row(
            name, f"{robot['x']:.3f}", f"{robot['y']:.3f}", f"{_heading(robot['theta']):.1f}",
            f"{robot['left']:.3f}", f"{robot['right']:.3f}",
            state if robot["plugged"] else state.append(", cable disconnected", "red"),
        )  # fmt: skip
    failures = [f"{name}: {robot['failure']}" for name, robot in found.items() if robot.get("failure")]
    return Group(table, *(Text(failure, "red") for failure in failures))


def _heading(theta: float) -> float:
    """Degrees in (-180, 180]; counter-clockwise from ahead (REP-103)."""
    degrees = math.degrees(theta) % 360
    return degrees - 360 if degrees > 180 else degrees
