"""The record of commands: few lines, written beside the loop, whole after a power cut or a full disk."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.command import command_log
from swarm_onboard.command.authority import Authority, Commander, Sender
from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.command_log import GAP, MOST, By, CommandLog, CommandSpans, RecordFile
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.common.record_chain import FILE, OLDER

from swarmctl.plan.command_history import Span, Start, read
from tests.timing import wait_for

STARTED = {"release": "r1", "commanders": ["laptop (priority 0)"]}
JOY = Sender("/joystick", "10.0.0.1")
ENTRY = {"time": 1.0, "event": "started", **STARTED}
COMMANDS = st.lists(st.tuples(st.integers(0, 2 * MOST), st.floats(0.0, 2 * GAP)), max_size=60)


def spans_of(commands) -> list[dict[str, Any]]:
    spans, now, found = CommandSpans(), 0.0, []
    for who, pause in commands:
        now += pause
        found += spans.admitted(By("c", f"/n{who}", ""), now, 1000.0 + now)
    return [*found, *spans.close()]


@given(COMMANDS)
def test_each_span_begins_and_ends_once(commands):
    begun: set[str] = set()
    for entry in spans_of(commands):
        if entry["event"] == "began":
            assert entry["node"] not in begun
            begun.add(entry["node"])
            assert len(begun) <= MOST
        else:
            begun.remove(entry["node"])
    assert not begun


@given(st.lists(st.floats(0.0, 2 * GAP), min_size=1, max_size=40))
def test_a_node_that_pulses_has_one_span_until_it_is_silent(pauses):
    found = spans_of([(0, pause) for pause in pauses])
    assert len(found) == 2 * (1 + sum(pause >= GAP for pause in pauses[1:]))
    driven = sum(pause for pause in pauses[1:] if pause < GAP)
    assert sum(one["seconds"] for one in found if one["event"] == "ended") == pytest.approx(driven, abs=2.5)


def text_of(folder: Path) -> str:
    return "".join((folder / one).read_text() for one in (OLDER, FILE) if (folder / one).exists())


def test_a_span_and_the_start_are_recorded(tmp_path: Path) -> None:
    log = CommandLog(tmp_path, STARTED, lambda: 50.0, lambda: 1000.0)
    log.admitted("laptop", JOY)
    log.admitted("laptop", JOY)
    log.close()
    found = read(text_of(tmp_path), None)
    assert found.problem == log.trouble() == ""
    assert found.events == (
        Start(1000.0, "r1", ("laptop (priority 0)",), True, 0),
        Span(1000.0, "laptop", "/joystick", "10.0.0.1", 0.0, False),
    )


def test_an_end_is_written_while_nobody_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command_log, "GAP", 0.01)
    log = CommandLog(tmp_path, STARTED)
    log.admitted("laptop", JOY)
    wait_for(lambda: '"ended"' in text_of(tmp_path))
    log.close()


def test_only_what_is_obeyed_is_recorded(tmp_path: Path) -> None:
    log, commands, now = CommandLog(tmp_path, STARTED), CommandMailbox(), [0.0]
    authority = Authority([Commander("laptop", 0, addresses=("10.0.0.1",))], 0.5)
    gate = CommandGate(authority, commands, log, lambda: now[0])
    still = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    gate.give("/stranger", "10.0.0.9", *still)
    gate.give("/joystick", "10.0.0.1", *still)
    gate.give("/other", "10.0.0.1", *still)  # behind the joystick, which holds the robot
    commands.hold(held=True)
    now[0] += 1.0
    gate.give("/other", "10.0.0.1", *still)
    log.close()
    found = [one for one in read(text_of(tmp_path), None).events if isinstance(one, Span)]
    assert [(one.commander, one.node) for one in found] == [("laptop", "/joystick")]


def test_a_torn_line_is_marked_and_leaves_a_span_without_end(tmp_path: Path) -> None:
    record = RecordFile(tmp_path)
    record.append([ENTRY, {"time": 2.0, "event": "began", **By("laptop", "/joystick", "")._asdict()}])
    with (tmp_path / FILE).open("ab") as file:
        file.write(b'{"number": 3, "prev')
    CommandLog(tmp_path, STARTED).close()
    first, span, second = read(text_of(tmp_path), None).events
    assert isinstance(first, Start)
    assert isinstance(span, Span)
    assert isinstance(second, Start)
    assert (span.seconds, span.ongoing) == (None, False)
    assert (first.cut, first.changed, second.cut, second.changed) == (0, True, 19, False)


def test_files_are_bounded_and_the_chain_goes_on(tmp_path: Path) -> None:
    for _ in range(4):  # each time another process
        record = RecordFile(tmp_path, full=1000)
        for _ in range(10):
            record.append([ENTRY])
    assert all(len((tmp_path / one).read_bytes()) < 1300 for one in (FILE, OLDER))
    found = read(text_of(tmp_path), None)
    assert found.head.number == 40
    assert found.problem.startswith("it begins with entry ")  # the real files are larger
    (tmp_path / FILE).write_bytes(b"")
    RecordFile(tmp_path).append([ENTRY])
    assert read(text_of(tmp_path), None).problem == found.problem


@pytest.fixture
def small_files() -> Iterator[None]:
    """No file of this process grows beyond 100 bytes, as on a full disk."""
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


@pytest.mark.usefixtures("small_files")
def test_a_full_disk_is_reported_and_leaves_no_half_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    attempts: list[object] = []
    write = RecordFile.append
    monkeypatch.setattr(RecordFile, "append", lambda *one: (attempts.append(one), write(*one)))
    monkeypatch.setattr(command_log, "_RETRY", 0.01)
    log = CommandLog(tmp_path, STARTED)
    gate = CommandGate(Authority([], 0.5), CommandMailbox(), log)
    wait_for(log.trouble)
    assert gate.standing().complaint == "commands are not recorded: File too large"
    assert text_of(tmp_path) == ""
    for part in range(2):
        for number in range(100):
            log.admitted("laptop", Sender(f"/{part}/{number}"))
        before = len(attempts)
        wait_for(lambda before=before: len(attempts) > before + 1)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    wait_for(lambda: not log.trouble())
    log.close()
    found = read(text_of(tmp_path), None)
    assert found.problem == ""
    (note,) = found.notes
    assert note.endswith("entries before entry 1 could not be written")
    assert int(note.split()[0]) + found.head.number == 1 + 2 * 200


def test_a_disk_that_hangs_holds_up_no_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hangs, writes = threading.Event(), threading.Event()

    def never(*_: object) -> None:
        writes.set()
        hangs.wait()

    monkeypatch.setattr(command_log, "_write_through", never)
    monkeypatch.setattr(command_log, "_LAST_WRITE", 0.0)
    now = [0.0]
    log = CommandLog(tmp_path, STARTED, lambda: now[0])
    writes.wait()
    log.admitted("laptop", JOY)
    assert log.trouble() == ""
    now[0] = 11.0
    assert log.trouble() == "commands are not recorded: the disk does not respond"
    log.close()
    hangs.set()


KILLED = """
import os, sys, threading
from pathlib import Path
from swarm_onboard.command.authority import Sender
from swarm_onboard.command.command_log import CommandLog
log = CommandLog(Path(sys.argv[1]), {"release": "r1", "commanders": []})
for number in range(10**9):
    log.admitted("laptop", Sender(f"/n{number}"))
"""


def test_a_killed_process_leaves_a_sound_record(tmp_path: Path) -> None:
    for _ in range(3):
        process = subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path)], env={**os.environ})
        size = len(text_of(tmp_path))
        try:
            wait_for(lambda size=size: len(text_of(tmp_path)) > size + 2000)
        finally:
            process.kill()
            process.wait()
    CommandLog(tmp_path, STARTED).close()
    assert read(text_of(tmp_path), None).problem == ""
    assert json.loads(text_of(tmp_path).splitlines()[0])["number"] == 1
