"""A lab's tables as people see them: compared with the texts in ``golden``."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.cells import cell_len
from rich.console import Console

from swarmctl.views import lab as view

GOLDEN = Path(__file__).parent / "golden"

STATUS = {
    "hosts": [
        {"name": "alpha", "state": "running", "address": "10.91.1.1", "user": "robot", "boots": 2},
        {"name": "beta", "state": "stopped", "address": "10.91.1.2", "user": "root", "boots": 1},
        {"name": "gamma", "state": "starting", "address": "10.91.2.1", "user": "root", "boots": 1},
    ],
    "networks": [
        {"name": "air", "hosts": {"alpha": True, "beta": False}},
        {"name": "wire", "hosts": {"alpha": True, "beta": True, "gamma": True}},
    ],
}


def robot(**changes: Any) -> dict[str, Any]:
    rest = {"x": 0.0, "y": 0.0, "theta": 0.0, "left": 0.0, "right": 0.0, "plugged": True}
    return {**rest, **changes}


ROBOTS = {
    "rover": robot(x=1.23456, y=-0.5, theta=-1.5707963, left=0.1, right=0.0999),
    "puck": robot(theta=9.42477796, plugged=False),
    "koala": robot(left=-0.2, right=0.2, plugged=False),
    "beetle": robot(plugged=False, failure="robots/beetle.emulator.py:9: ValueError: no"),
}


def shown(table: Any) -> str:
    screen = io.StringIO()
    Console(file=screen, width=120, color_system=None).print(table)
    return "".join(f"{line.rstrip()}\n" for line in screen.getvalue().splitlines())


@pytest.mark.parametrize(("name", "table"), [("hosts", view.hosts(STATUS)), ("robots", view.robots(ROBOTS))])
def test_the_table_matches_the_golden_file(
    name: str, table: Any, golden: Callable[[Path, str], None]
) -> None:
    golden(GOLDEN / f"{name}.txt", shown(table))


def test_a_stopped_lab_lists_its_hosts() -> None:
    assert "alpha  running" in shown(view.hosts({**STATUS, "networks": []}))


@pytest.mark.parametrize(
    ("theta", "degrees"), [(0.0, 0.0), (3.14159265, 180.0), (-3.14159265, 180.0), (7.0, 41.07)]
)
def test_headings_are_within_half_a_turn(theta: float, degrees: float) -> None:
    assert view._heading(theta) == pytest.approx(degrees, abs=0.01) or view._heading(theta) == pytest.approx(
        -degrees, abs=0.01
    )


FLEET = {
    **{f"tb3-{n:02}": robot() for n in range(1, 21)},
    **{f"p3-{n:02}": robot(x=float(n), left=0.1, right=0.1) for n in range(1, 4)},
}


def test_robots_at_one_place_share_a_row() -> None:
    lines = shown(view.robots(FLEET)).splitlines()
    assert lines[0] == "23 robots, 3 of them move"
    assert [line.split()[0] for line in lines[2:]] == ["tb3-[01-20]", "p3-01", "p3-02", "p3-03"]
    assert lines[2].endswith("stands still")


def test_details_show_each_robot() -> None:
    assert len(shown(view.robots(FLEET, details=True)).splitlines()) == 2 + len(FLEET)


def test_few_robots_are_not_counted() -> None:
    assert "move" not in shown(view.robots({"tb3-01": robot()})).splitlines()[0]


@pytest.mark.parametrize("width", [40, 60, 80])
def test_narrow_terminals_show_every_name_and_value(width: int) -> None:
    screen = io.StringIO()
    console = Console(file=screen, width=width, color_system=None, soft_wrap=True)
    console.print(view.robots({**ROBOTS, **FLEET}, width=width))
    console.print(view.hosts(STATUS, width=width))
    text = screen.getvalue()
    assert max(cell_len(line) for line in text.splitlines()) <= width
    assert "…" not in text
    for expected in (
        "tb3-[01-20]",
        "beetle",
        "-0.500",
        "-90.0",
        "emulator failed",
        "10.91.2.1",
        "gamma",
        "(cut)",
    ):
        assert expected in text
