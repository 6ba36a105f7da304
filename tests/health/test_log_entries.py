"""Logs of hosts: parsed, rated, merged by the operator's clock."""

from __future__ import annotations

import json
import re
from datetime import datetime, timedelta, timezone

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.health import log_entries
from swarmctl.health.log_entries import Entry

NOW = datetime(2026, 11, 26, 22, 0, tzinfo=timezone.utc)


def line(message: object, priority: int = 6, at: float = 100.0) -> bytes:
    fields = {"__REALTIME_TIMESTAMP": str(int(at * 1e6)), "_SYSTEMD_UNIT": "swarm-s.k3.service"}
    return json.dumps(fields | {"MESSAGE": message, "PRIORITY": str(priority)}).encode()


@pytest.mark.parametrize(
    ("message", "priority", "level"),
    [
        ("hello", 6, "info"),
        ("hello", 3, "error"),
        ("[WARN] [1700000000.1]: low", 6, "warn"),
        ("[ERROR] [1700000000.1] [k3.driver]: lost", 6, "error"),
        ("[WARNING] low", 6, "warn"),
    ],
)
def test_the_text_of_ros_decides_the_level_before_the_priority(
    message: str, priority: int, level: str
) -> None:
    found = log_entries.parse(line(message, priority), "pi", "s", 0.0)
    assert found is not None
    assert (found.level, found.source) == (level, "k3")


@pytest.mark.parametrize("text", [b"", b"{}", b"[]", b"3", b'AGE": "cut"}'])
def test_what_is_no_entry_is_left_out(text: bytes) -> None:
    assert log_entries.parse(text, "pi", "s", 0.0) is None


def test_bytes_of_the_journal_are_text() -> None:
    found = log_entries.parse(line([104, 105, 255]), "pi", "s", 0.0)
    assert found is not None
    assert found.message == "hi\\xff"


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 1000))))
def test_entries_come_in_true_order_whatever_the_clocks_say(written: list[tuple[int, int]]) -> None:
    offsets = [0.0, 30.0, -50.0]
    hosts: list[list[Entry]] = [[], [], []]
    for host, at in written:
        found = log_entries.parse(line("m", at=at + 100 + offsets[host]), str(host), "s", offsets[host])
        assert found is not None
        hosts[host].append(found)
    times = [round(entry.time) - 100 for entry in log_entries.merged(hosts, "debug", None)]
    assert times == sorted(at for _, at in written), "in order, none lost, none double"


def test_level_and_pattern_select() -> None:
    entries = [
        Entry(1, "h", "k", "info", "low"),
        Entry(2, "h", "k", "error", "low"),
        Entry(3, "h", "k", "fatal", ""),
    ]
    assert log_entries.merged([entries], "warn", re.compile("lo")) == [entries[1]]


@pytest.mark.parametrize(
    ("text", "ago"),
    [("10m", timedelta(minutes=10)), ("2h", timedelta(hours=2)), ("1d", timedelta(days=1))],
)
def test_since_counts_back(text: str, ago: timedelta) -> None:
    assert log_entries.since(text, NOW) == (NOW - ago).timestamp()


@pytest.mark.parametrize("text", ["2026-11-26 21:00", "21:00", "21:00:00"])
def test_since_is_a_time_on_this_clock(text: str) -> None:
    now = NOW.replace(tzinfo=None).astimezone()
    assert log_entries.since(text, now) == now.replace(hour=21).timestamp()


@pytest.mark.parametrize("text", ["10", "m", "yesterday", "25:00", "-1m"])
def test_since_refuses_what_is_no_time(text: str) -> None:
    with pytest.raises(ValueError, match=re.escape(text)):
        log_entries.since(text, NOW)
