"""Logs of hosts: rated, merged by the operator's clock, in order and complete whatever arrives when."""

from __future__ import annotations

import os
import re
from datetime import datetime, timedelta, timezone

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.agent.verbs import logs
from swarm_onboard.ros1_probe.client import CALLER

from swarmctl.health import host_logs
from swarmctl.health.host_logs import WINDOW, Choice, Entry, Merge

NOW = datetime(2026, 11, 26, 22, 0, tzinfo=timezone.utc)
ROSPY = "[INFO] [1795919558.700696]: topic[/k3/odom]"
CALLER_OF_7 = CALLER.replace(str(os.getpid()), "7")  # the names of tests are those of all processes
FAST_DDS = "Problem to set scheduler of thread with id [812,dds.udp.7411]"
OFFSETS = [0.0, 30.0, -50.0]  # s


def read(message: str, priority: int = 6, at: float = 100.0) -> logs.Entry:
    return logs.Entry(at, "swarm-s.k3.service", priority, message)


def merged(*entries: Entry) -> list[Entry]:
    merge = Merge()
    for entry in entries:
        merge.add(entry, 0.0)
    return list(merge.rest())


def logged(host: str, at: float, message: str, level: str = "info") -> Entry:
    return Entry(at, host, "k3", level, message)


@pytest.mark.parametrize(
    ("message", "priority", "level"),
    [
        ("hello", 6, "info"),
        ("hello", 3, "error"),
        ("[WARN] [1700000000.1]: low", 6, "warn"),
        ("[ERROR] [1700000000.1] [k3.driver]: lost", 6, "error"),
        ("[WARNING] low", 6, "warn"),
        ("ERROR: /dev/swarm/k3 is gone", 6, "error"),
        ("OK: connected", 6, "info"),
        ("\x1b[33m[ WARN] [1700000000.1]: low\x1b[0m", 6, "warn"),
        ("Traceback (most recent call last):", 6, "error"),
        (f"{ROSPY} adding connection to [{CALLER_OF_7}], count 0", 6, "debug"),
        (f"{ROSPY} removing connection to {CALLER_OF_7}", 6, "debug"),
        (f"{ROSPY} adding connection to [/rviz_4711], count 0", 6, "info"),
        (f"{FAST_DDS} to value 0. Error 'Operation not permitted' -> Function f", 6, "debug"),
        (
            f"2026-11-29 02:32:37.401 [SYSTEM Error] {FAST_DDS} to value 0. Error 'Operation not permitted'",
            6,
            "debug",
        ),
        (f"{FAST_DDS} to value 7. Error 'Operation not permitted'", 6, "info"),
    ],
)
def test_the_text_of_ros_decides_the_level_before_the_priority(
    message: str, priority: int, level: str
) -> None:
    found = host_logs.entry_of(read(message, priority), "pi", "s", 0.0)
    assert (found.level, found.source) == (level, "k3")


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 1000))))
def test_entries_come_in_true_order_whatever_the_clocks_say(written: list[tuple[int, int]]) -> None:
    entries = [
        host_logs.entry_of(read("m", at=at + 100 + OFFSETS[host]), str(host), "s", OFFSETS[host])
        for host, at in written
    ]
    times = [round(entry.time) - 100 for entry in merged(*entries)]
    assert times == sorted(at for _, at in written), "in order, none lost, none double"


@given(st.lists(st.tuples(st.integers(0, 2), st.floats(0.0, 10.0), st.floats(0.0, 0.99 * WINDOW))))
def test_entries_on_their_way_for_less_than_the_window_come_in_order(
    written: list[tuple[int, float, float]],
) -> None:
    arrivals = sorted((at + late, host, at) for host, at, late in written)
    merge = Merge()
    shown: list[Entry] = []
    for now, host, at in arrivals:
        shown += merge.due(now)
        merge.add(logged(str(host), at, "m"), now)
    shown += merge.rest()
    assert [one.time for one in shown] == sorted(at for _, at, _ in written)


def test_a_silent_host_holds_up_nobody() -> None:
    merge = Merge()
    merge.add(logged("a", 1.0, "m"), 10.0)
    assert list(merge.due(10.0 + WINDOW / 2)) == []
    assert [one.time for one in merge.due(10.0 + WINDOW)] == [1.0]
    assert list(merge.rest()) == []


def test_a_flood_does_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_logs, "MOST_PENDING", 3)
    merge = Merge()
    for number in range(5):
        merge.add(logged("a", float(number), "m"), 0.0)
    assert [one.time for one in merge.due(0.0)] == [0.0, 1.0]


TRACEBACK = ["Traceback (most recent call last):", '  File "a.py", line 1', "    f()", "ValueError: no"]


def test_a_traceback_stays_together_between_the_lines_of_other_hosts() -> None:
    lines = [logged("a", 1.0 + number / 1000, one) for number, one in enumerate([*TRACEBACK, "next"])]
    others = [logged("b", 1.0005 + number / 1000, "b") for number in range(5)]
    shown = merged(*sorted([*lines, *others], key=lambda one: one.time))
    assert [one.message for one in shown if one.host == "a"] == ["\n".join(TRACEBACK), "next"]
    assert len(shown) == 2 + 5
    assert shown[0] in Choice(pattern=re.compile("ValueError")), "one line that matches shows all of it"


@pytest.mark.parametrize(
    "later", [logged("a", 1.2, "  late"), logged("a", 1.01, "[INFO] x"), logged("a", 0.5, " x")]
)
def test_lines_that_do_not_belong_together_stay_apart(later: Entry) -> None:
    assert len(merged(logged("a", 1.0, "first"), later)) == 2


def test_colours_are_no_part_of_a_message() -> None:
    found = host_logs.entry_of(read("\x1b[33m[ WARN] [1.0]: low\x1b[0m"), "pi", "s", 0.0)
    assert found.message == "[ WARN] [1.0]: low"


def test_an_output_without_end_is_shown_in_parts() -> None:
    shown = merged(*[logged("a", number / 1000, " x") for number in range(450)])
    assert [one.message.count("\n") for one in shown] == [199, 199, 49]


def test_level_and_pattern_select() -> None:
    entries = [logged("h", 1, "low"), logged("h", 2, "low", "error"), logged("h", 3, "", "fatal")]
    choice = Choice("warn", re.compile("lo"))
    assert [one for one in entries if one in choice] == [entries[1]]


@pytest.mark.parametrize(
    ("text", "ago"),
    [("10m", timedelta(minutes=10)), ("2h", timedelta(hours=2)), ("1d", timedelta(days=1))],
)
def test_since_counts_back(text: str, ago: timedelta) -> None:
    assert host_logs.since(text, NOW) == (NOW - ago).timestamp()


@pytest.mark.parametrize("text", ["2026-11-26 21:00", "21:00", "21:00:00"])
def test_since_is_a_time_on_this_clock(text: str) -> None:
    now = NOW.replace(tzinfo=None).astimezone()
    assert host_logs.since(text, now) == now.replace(hour=21).timestamp()


@pytest.mark.parametrize("text", ["10", "m", "yesterday", "25:00", "-1m"])
def test_since_refuses_what_is_no_time(text: str) -> None:
    with pytest.raises(ValueError, match=re.escape(text)):
        host_logs.since(text, NOW)
