"""The chain of a record: whatever is changed, removed or moved is found by who reads it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.common.record_chain import BEGINNING, FULL, line_after, whole_part

from swarmctl.plan.command_history import CHANGED, Record, read

NAMES = st.text("ab\u2028\x1b", max_size=3)
STARTED = st.builds(
    lambda names: {"time": 1.0, "event": "started", "release": "r", "commanders": names},
    st.lists(NAMES, max_size=2),
)
BEGAN = st.builds(
    lambda name: {"time": 2.0, "event": "began", "commander": name, "node": "/n", "host": ""}, NAMES
)
ENDED = st.builds(
    lambda name: {
        "time": 3.0, "event": "ended", "commander": name, "node": "/n", "host": "", "seconds": 1.0,
    },
    NAMES,
)  # fmt: skip
ENTRIES = st.lists(STARTED | BEGAN | ENDED, min_size=2, max_size=8)


def lines_of(entries, head=BEGINNING):
    lines = []
    for entry in entries:
        line, head = line_after(head, entry)
        lines.append(line)
    return lines


def text_of(lines) -> str:
    return "".join(line.decode() + "\n" for line in lines)


def reread(before, after) -> Record:
    """What an operator finds who has read ``before``."""
    return read(text_of(after), read(text_of(before), None).head)


@given(ENTRIES)
def test_a_record_that_grew_is_sound(entries):
    lines = lines_of(entries)
    for seen in range(len(lines) + 1):
        found = reread(lines[:seen], lines)
        assert (found.problem, found.head.number) == ("", len(lines))


@given(ENTRIES, st.data())
def test_a_changed_line_is_found(entries, data):
    lines = lines_of(entries)
    place = data.draw(st.integers(0, len(lines) - 1))
    at = data.draw(st.integers(0, len(lines[place]) - 1))
    other = data.draw(st.integers(32, 126).filter(lambda one: one != lines[place][at]))
    changed = lines[place][:at] + bytes([other]) + lines[place][at + 1 :]
    assert reread(lines, [*lines[:place], changed, *lines[place + 1 :]]).problem


@given(ENTRIES, st.data())
def test_a_removed_line_is_found(entries, data):
    lines = lines_of(entries)
    place = data.draw(st.integers(0, len(lines) - 1))
    assert reread(lines, [*lines[:place], *lines[place + 1 :]]).problem


@given(ENTRIES, st.data())
def test_lines_in_another_order_are_found(entries, data):
    lines = lines_of(entries)
    moved = data.draw(st.permutations(lines).filter(lambda one: one != lines))
    assert reread(lines, moved).problem


@given(ENTRIES, ENTRIES)
def test_a_record_written_anew_is_found_by_its_last_reader(entries, others):
    lines, anew = lines_of(entries), lines_of(others)
    if lines == anew[: len(lines)]:
        return
    assert not read(text_of(anew), None).problem
    assert reread(lines, anew).problem.startswith(CHANGED)


@given(ENTRIES, st.data())
def test_a_torn_line_is_cut_off_and_the_chain_goes_on(entries, data):
    lines = lines_of(entries)
    content = text_of(lines).encode()
    torn = content[: data.draw(st.integers(0, len(content)))]
    torn += data.draw(st.sampled_from([b"", b"\0" * 40, b"\0\n", b'{"number": 9'])) if lines else b""
    size, head = whole_part(torn)
    assert torn[:size] == text_of(lines[: head.number]).encode()
    assert torn[:size].count(b"\n") == head.number
    assert not read(torn[:size].decode() + text_of(lines_of(entries, head)), None).problem


def test_what_a_full_file_replaced_is_named_if_it_was_not_read() -> None:
    entry = {"time": 1.0, "event": "started", "release": "r" * 1000, "commanders": []}
    lines = lines_of([entry] * (FULL // 1000 + 10))
    found = reread(lines[:2], lines[5:])
    assert (found.problem, found.notes) == (
        "",
        ("entries 3 to 5 were replaced by newer ones before you read them",),
    )
    assert reread(lines[:5], lines[5:]).notes == ()


@pytest.mark.parametrize(
    "line",
    [
        "{", "[]", "{}", '{"number": 1, "previous": ""}', '{"number": 1, "previous": "", "event": []}',
        '{"number": 1, "previous": "", "event": "began", "time": NaN}', "[" * 9999, "?",
        '{"number": 1, "previous": "", "event": "started", "release": "", "time": 1e300, "commanders": []}',
        '{"number": true, "previous": "", "event": "started", "release": "", "time": 1, "commanders": []}',
    ],
)  # fmt: skip
def test_a_line_of_anything_else_is_damaged(line: str) -> None:
    assert read(line + "\n", None).problem == "the line after entry 0 is damaged"
