"""Lines of log entries: further lines below, nothing that controls a terminal, one colour for each robot."""

from __future__ import annotations

import re

from swarmctl.health.host_logs import Entry
from swarmctl.views import logs


def entry(source: str, message: str) -> Entry:
    return Entry(1700000000.25, "pi", source, "warn", message)


def test_further_lines_of_a_message_are_below_its_first() -> None:
    first, second = logs.lines(entry("k3/gate", "a\x1b[2J\n  b")).plain.split("\n")
    assert re.sub(r"^..:..", "", first) == ":20.250 k3/gate  warn   a\\x1b[2J"
    assert second == "      b"


def test_the_units_of_a_robot_have_one_colour() -> None:
    def colour(source: str) -> str:
        return str(logs.lines(entry(source, "m")).spans[0].style)

    assert colour("k3") == colour("k3/gate")
    assert len({colour(f"robot-{number}") for number in range(20)}) > 3


def test_a_dated_line_is_by_the_clock_of_its_host() -> None:
    assert logs.dated(entry("k3", "low\tbattery\nagain"), 3600.0) == (
        "2023-11-14T23:13:20.250Z k3  warn   low battery\n    again"
    )
