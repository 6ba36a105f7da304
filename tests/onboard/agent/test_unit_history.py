"""What the agent adds to the state of units: restarts within a window, exits, stopped processes."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from swarm_onboard.agent import conditions, processes, systemd, unit_history, unit_journal, unit_start
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.release_store import Home

from tests.onboard.agent.fakehost import RUNS

UNIT = "swarm-test.k3.service"
NOW, UP = 1_700_000_900.0, 60.0  # s since 1970, and since the boot
RESTART, EXIT = "5eb03494b6584870a536b337290809b3", "98e322203f7a4ed290d09fe03c09fe15"


def program(folder: Path, name: str, script: str) -> None:
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A host whose journalctl prints the file ``journal``, and notes how it was called."""
    program(tmp_path, "journalctl", f'echo "$*" >> {tmp_path}/calls; cat {tmp_path}/journal')
    program(tmp_path, "systemctl", f"printf 'Id=%s\\nInactiveExitTimestampMonotonic=%s\\n' {UNIT} 5000000")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(unit_history, "time", SimpleNamespace(time=lambda: NOW, monotonic=lambda: UP))
    return tmp_path


def journal(host: Path, *entries: dict[str, Any]) -> None:
    lines = [json.dumps({"UNIT": UNIT, "__REALTIME_TIMESTAMP": "1700000500000000", **one}) for one in entries]
    (host / "journal").write_text("\n".join([*lines, "-- No entries --", "7"]), encoding="utf-8")


def exited(code: str, status: str, what: str = "Main process") -> dict[str, str]:
    return {"MESSAGE_ID": EXIT, "MESSAGE": f"{what} exited", "EXIT_CODE": code, "EXIT_STATUS": status}


RESTARTED = {"MESSAGE_ID": RESTART, "MESSAGE": "Scheduled restart job"}


@pytest.mark.parametrize(
    ("event", "shown"),
    [
        (exited("exited", "75"), "exit code 75"),
        (exited("killed", "9"), "SIGKILL"),
        (exited("dumped", "6"), "SIGABRT"),
        (exited("killed", "99"), "signal 99"),
        (exited("exited", "nonsense"), ""),
        (exited("exited", "1", what="Control process"), ""),
        ({**exited("exited", "1"), "UNIT": "other.service"}, ""),
        ({**exited("exited", "3"), "MESSAGE": [*b"\x1b[1mMain process"]}, "exit code 3"),
    ],
)
def test_the_last_exit_is_in_the_journal(event: dict[str, Any], shown: str, host: Path) -> None:
    journal(host, RESTARTED, event)
    assert unit_journal.restarts([UNIT], 5.0) == {UNIT: ([1700000500.0], shown, 0)}


@pytest.mark.parametrize(
    ("restarts", "events", "recent"),
    [(0, 4, 0), (2, 4, 2), (9, 4, 4)],
    ids=["started by hand since", "two since it was started by hand", "others are older than the window"],
)
def test_restarts_count_since_a_start_by_hand(restarts: int, events: int, recent: int, host: Path) -> None:
    journal(host, *[RESTARTED] * events)
    seen = {UNIT: RUNS._replace(restarts=restarts, active="active")}
    assert unit_history.with_restarts(Home("test", str(host)), seen, 600.0)[0][UNIT].recent == recent


def test_a_restarted_unit_has_run_for_a_time(host: Path) -> None:
    journal(host, RESTARTED)
    entered = (UP - 3) * 1e6
    program(host, "systemctl", f"printf 'Id=%s\\nActiveEnterTimestampMonotonic=%d\\n' {UNIT} {entered:.0f}")
    for active, seconds in (("active", 3.0), ("activating", 0.0)):
        seen = {UNIT: RUNS._replace(restarts=1, active=active)}
        assert unit_history.with_restarts(Home("test", str(host)), seen, 600.0)[0][UNIT].running == seconds


def test_the_end_of_the_log_of_a_unit_that_does_not_run_is_shown(host: Path) -> None:
    """Not of one that runs: what it has logged is of no failed start."""
    lines = ["the first", "\x1b[31mno port\x1b[0m", "k3 confirmed the stop", "starts again in 8 s"]
    journal(host, *[{"MESSAGE": one, "_SYSTEMD_UNIT": UNIT} for one in lines])
    for active, shown in (("active", ""), ("activating", " | ".join(["no port", *lines[2:]]))):
        seen = {UNIT: RUNS._replace(restarts=1, active=active)}
        found, _ = unit_history.with_restarts(Home("test", str(host)), seen, 600.0)
        assert (found[UNIT].log, found[UNIT].starting) == (shown, 0.0)


def test_the_last_line_of_a_log_is_shown_whole_and_once(host: Path) -> None:
    journal(host, *[{"MESSAGE": one} for one in ("x" * 290, "the port is taken", "the port is taken")])
    assert unit_start.last_log(UNIT, 3, 300) == "the port is taken"
    assert unit_start.last_log(UNIT, 1) == "the port is taken"
    assert unit_start.last_log(UNIT).startswith("xxx")


def test_a_first_start_that_takes_long_is_measured(host: Path) -> None:
    journal(host)
    left = (UP - 30) * 1e6
    program(host, "systemctl", f"printf 'Id=%s\\nInactiveExitTimestampMonotonic=%d\\n' {UNIT} {left:.0f}")
    seen = {UNIT: RUNS._replace(restarts=0, active="activating")}
    assert unit_history.with_restarts(Home("test", str(host)), seen, 600.0)[0][UNIT].starting == 30.0


def test_a_restart_that_follows_a_new_master_does_not_count(host: Path) -> None:
    rejoined = exited("exited", "91"), RESTARTED
    journal(host, *rejoined, *rejoined, exited("exited", "1"), RESTARTED)
    assert unit_journal.restarts([UNIT], 5.0) == {UNIT: ([1700000500.0], "exit code 1", 2)}
    started_by_hand = exited("exited", "91"), {**RESTARTED, "N_RESTARTS": "1"}
    journal(host, *rejoined, *rejoined, *started_by_hand)
    assert unit_journal.restarts([UNIT], 5.0)[UNIT].rejoined == 1


def test_the_journal_is_left_alone_where_nothing_restarted(host: Path) -> None:
    seen = {UNIT: RUNS._replace(restarts=0, active="active")}
    _, since = unit_history.with_restarts(Home("test", str(host)), seen, 600.0)
    assert not (host / "calls").exists()
    assert since[UNIT] == NOW - UP + 5


def test_the_time_before_the_current_release_does_not_count(host: Path) -> None:
    home = Home("test", str(host))
    Path(home.path).mkdir(parents=True)
    Path(home.current_link).symlink_to("releases/a")
    journal(host, RESTARTED)
    seen = {UNIT: RUNS._replace(restarts=3, active="active")}
    found, since = unit_history.with_restarts(home, seen, 600.0)
    assert since[UNIT] == Path(home.current_link).lstat().st_mtime
    assert found[UNIT].recent == 0


def proc(folder: Path, pid: int, group: str, state: str, words: Sequence[str]) -> None:
    place = folder / str(pid)
    place.mkdir()
    (place / "cgroup").write_text(f"1:name=systemd:{group}\n0::{group}\n")
    (place / "stat").write_text(f"{pid} (a) b) {state} 1 1\n")
    (place / "cmdline").write_text("\0".join([*words, ""]))


def test_processes_belong_to_a_unit_by_their_control_group(tmp_path: Path) -> None:
    unit = f"/system.slice/{UNIT}"
    proc(tmp_path, 7, unit, "T", ["/usr/bin/python3", "/opt/x/scan.py", "__name:=scan"])
    proc(tmp_path, 8, f"/machine.slice/lab{unit}/inner", "S", ["/bin/cat"])
    proc(tmp_path, 9, f"{unit}2", "T", ["/bin/other"])
    (tmp_path / "10").mkdir()
    found = processes.of_units({UNIT: unit, "away.service": ""}, str(tmp_path))
    assert [(one.pid, one.name, one.stopped) for one in found[UNIT]] == [
        (7, "scan.py", True),
        (8, "cat", False),
    ]
    assert found["away.service"] == []


def test_a_listening_port_is_found_by_its_process() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as talk,
    ):
        ports = processes.listening_ports(os.getpid())
        assert server.getsockname()[1] in ports
        assert talk.getsockname()[1] not in ports


def test_conditions_of_a_unit_that_are_not_met_are_named(tmp_path: Path) -> None:
    """As the templates write them; a line that is no such condition is passed over."""
    (tmp_path / "there").write_text("")
    executable = tmp_path / "run"
    program(tmp_path, "run", "true")
    lines = [
        f"ConditionPathExists={tmp_path}/there",
        f"ConditionPathExists={tmp_path}/away",
        f"ConditionFileIsExecutable={executable}",
        f"ConditionFileIsExecutable={tmp_path}/there",
        "ConditionPathExists=!/relative",
        f"Environment=ConditionPathExists={tmp_path}/elsewhere",
    ]
    unit = tmp_path / "a.service"
    unit.write_text("\n".join(["[Unit]", *lines]))
    assert conditions.unmet(str(unit)) == [
        f"ConditionPathExists={tmp_path}/away",
        f"ConditionFileIsExecutable={tmp_path}/there",
    ]
    assert conditions.unmet("") == conditions.unmet(f"{tmp_path}/no.service") == []


def test_a_skipped_unit_names_what_is_not_met(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unit = tmp_path / "a.service"
    unit.write_text(f"[Unit]\nConditionPathExists={tmp_path}/away\n")
    shown = ("ActiveState=inactive", "ConditionResult=no", "ConditionTimestampMonotonic=1")
    printed = "\n".join((*shown, f"FragmentPath={unit}"))
    monkeypatch.setattr(systemd, "call", lambda command, timeout: printed)

    assert systemd.states(["a.service"])["a.service"].unmet == [f"ConditionPathExists={tmp_path}/away"]


@pytest.mark.parametrize(("looks", "starts"), [(3, True), (99, False)])
def test_a_failed_start_that_systemd_repeats_is_waited_for(
    looks: int, starts: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """systemd tries again by itself; only a unit that never starts is a failure of the deploy."""
    monkeypatch.setattr(unit_start, "AGAIN", 0.2)
    monkeypatch.setattr(unit_start, "_LOOK_EVERY", 0.01)
    count = tmp_path / "looks"
    program(
        tmp_path,
        "systemctl",
        f'case "$1" in start) echo no >&2; exit 1;; show) echo >> {count};; *) exit 0;; esac\n'
        f"[ $(wc -l < {count}) -ge {looks} ] && state=active || state=activating\n"
        f"printf 'Id={UNIT}\\nActiveState=%s\\n' $state",
    )
    program(tmp_path, "journalctl", "true")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    if starts:
        unit_start.start([UNIT])
        return
    with pytest.raises(FailedError, match="did not start"):
        unit_start.start([UNIT])


def test_last_log_is_text_without_terminal_sequences(host: Path) -> None:
    """roscore writes a window title and colours; journalctl prints such lines as lists of bytes."""
    title = [*b"\x1b]2;http://10.0.0.1:11311/\x07\x1b[1mstarted roslaunch server\x1b[0m"]
    journal(host, {"MESSAGE": "first"}, {"MESSAGE": title}, {"MESSAGE": "  "}, {"MESSAGE": "killing on exit"})
    assert unit_start.last_log(UNIT) == "first | started roslaunch server | killing on exit"
