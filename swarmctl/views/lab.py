"""A lab as text: its hosts and networks, and the poses of its robots."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

_SPEEDS = ("left", "right", "v", "omega")
_VALUES = (("x", " m"), ("y", " m"), ("heading", "°"), ("left", " m/s"), ("right", " m/s"))
_NARROWEST = 72  # columns of a table of robots; in fewer the values stand below the names
_Row = tuple[str, tuple[str, ...], Text]  # robots, values, state
_STYLE = {"running": "green", "starting": "yellow", "stopped": "red"}


def hosts(status: Mapping[str, Any], *, details: bool = False, width: int | None = None) -> Table | Text:
    """One row per host: state, address, number of boots, networks; one for more than a few equal hosts.

    On a narrow terminal, what follows the state stands below the names.
    """
    rows = [(host, _cables(status, host["name"])) for host in status["hosts"]]
    groups = grouped(
        rows,
        lambda row: (*(row[0][key] for key in ("state", "user", "boots")), row[1].plain),
        alone=lambda group: details or len(group) <= FEW,
    )
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("HOST", "STATE", "ADDRESS", "USER", "BOOTS", "NETWORKS"):
        table.add_column(title, overflow="fold")
    lines = []
    for group in groups:
        host, cables = group[0]
        names, addresses = (hostlist.written(one[key] for one, _ in group) for key in ("name", "address"))
        state = Text(host["state"], _STYLE.get(host["state"], ""))
        table.add_row(names, state, addresses, host["user"], str(host["boots"]), cables)
        rest = Text(f"    {addresses}  {host['user']}  boots {host['boots']}  ").append_text(cables)
        lines += [(Text.assemble((names, "bold"), "  ", state), 2), (rest, 4)]
    if width is None or width >= _NARROWEST:
        return table
    return Text("\n").join(wrapped(line, width, indent) for line, indent in lines)


def _cables(status: Mapping[str, Any], host: str) -> Text:
    return Text(", ").join(_cable(one, host) for one in status["networks"] if host in one["hosts"])


def _cable(network: Mapping[str, Any], host: str) -> Text:
    return Text(network["name"]) if network["hosts"][host] else Text(f"{network['name']} (cut)", "red")


def robots(
    found: Mapping[str, Mapping[str, Any]], *, details: bool = False, width: int | None = None
) -> Group:
    """One row per robot: true pose (m, degrees), true wheel speeds (m/s), whether it moves.

    One row for more than a few robots of which the same is true. Above the rows of many robots stands how
    many move, below them the failures of users' own emulators. On a narrow terminal the values of a robot
    stand below its name.
    """
    moving = sum(_moves(robot) for robot in found.values())
    summary = Text(f"{len(found)} robots, {moving} of them move") if len(found) > FEW else None
    groups = grouped(
        ((name, _values(robot), _state(robot)) for name, robot in found.items()),
        lambda row: (row[1], row[2].plain),
        alone=lambda group: details or len(group) <= FEW,
    )
    rows = [(hostlist.written(name for name, _, _ in group), *group[0][1:]) for group in groups]
    shown = _table(rows) if width is None or width >= _NARROWEST else _stacked(rows, width)
    failures = [Text(f"{name}: {robot['failure']}", "red") for name, robot in found.items() if _failed(robot)]
    fitting = [wrapped(failure, width, 4) for failure in failures]
    return Group(*([summary] if summary else []), shown, *fitting)


def _table(rows: Sequence[_Row]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("ROBOT", overflow="fold", min_width=12)
    for title, unit in _VALUES:
        table.add_column(f"{title.upper()}{unit}", justify="right", no_wrap=True)
    table.add_column("STATE", overflow="fold", min_width=12)
    for name, values, state in rows:
        table.add_row(name, *values, state)
    return table


def _stacked(rows: Sequence[_Row], width: int) -> Text:
    lines = []
    for name, values, state in rows:
        named = (f"{title} {value}{unit}" for value, (title, unit) in zip(values, _VALUES, strict=True))
        lines.append(wrapped(Text.assemble((name, "bold"), "  ", state), width, 2))
        lines.append(wrapped(Text(f"    {', '.join(named)}"), width, 4))
    return Text("\n").join(lines)


def _values(robot: Mapping[str, Any]) -> tuple[str, ...]:
    speeds = (f"{robot[key]:.3f}" for key in ("left", "right"))
    return f"{robot['x']:.3f}", f"{robot['y']:.3f}", f"{_heading(robot['theta']):.1f}", *speeds


def _state(robot: Mapping[str, Any]) -> Text:
    state = Text("moves", "green") if _moves(robot) else Text("stands still")
    if _failed(robot):
        state = Text("emulator failed", "red")
    return state if robot["plugged"] else state.append(", cable disconnected", "red")


def _moves(robot: Mapping[str, Any]) -> bool:
    return any(robot.get(key) for key in _SPEEDS)


def _failed(robot: Mapping[str, Any]) -> bool:
    return bool(robot.get("failure"))


def _heading(theta: float) -> float:
    """Degrees in (-180, 180]; counter-clockwise from ahead (REP-103)."""
    degrees = math.degrees(theta) % 360
    return degrees - 360 if degrees > 180 else degrees
