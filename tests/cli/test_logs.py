"""``swarmctl logs``: what it prints of hosts that answer, fail, or come and go; and how it ends."""

from __future__ import annotations

import fcntl
import io
import json
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from queue import Queue
from typing import Any

import pytest

from swarmctl import streams
from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.health import host_logs
from swarmctl.health.host_logs import Entry, HostLog
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind

LAPTOP, PI = "koala-laptop", "k3-pi"
AWAY = HostError(Kind.UNREACHABLE, "no answer")
FAILED = HostError(Kind.FAILED, "journalctl ended with status 1", "look")
Found = list[tuple[str, HostLog | HostError]]


def log(host: str, *entries: tuple[float, str], offset: float = 0.0, cut: bool = False) -> HostLog:
    return HostLog([Entry(at, host, "k3", "info", text) for at, text in entries], offset, cut)


@pytest.fixture
def logs(
    leader_spec: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, list[str], str]]:
    """Runs the verb on hosts that send this; returns exit code, messages, and standard error."""
    monkeypatch.setenv("HOME", str(leader_spec.parent))

    def called(found: Found, *options: str) -> tuple[int, list[str], str]:
        queue: Queue[Any] = Queue()
        for one in found:
            queue.put(one)
        events = [Finished(host, outcome, 0.0) for host, outcome in found]
        monkeypatch.setattr(host_logs, "host_logs", lambda *_, **__: iter(events))
        monkeypatch.setattr(host_logs, "followed", lambda *_: queue)
        status = run(["logs", str(leader_spec), LAPTOP, PI, "--json", *options])
        printed = capsys.readouterr()
        return status, [json.loads(line)["message"] for line in printed.out.splitlines()], printed.err

    return called


def test_hosts_that_do_not_answer_hold_up_nobody(logs: Callable[..., Any]) -> None:
    there = (LAPTOP, log(LAPTOP, (2.0, "b"), (1.0, "a")))
    assert logs([there, (PI, AWAY)]) == (
        exit_codes.HOSTS_UNREACHABLE,
        ["a", "b"],
        f"{PI}  unreachable: no answer\n",
    )
    assert logs([there, (PI, FAILED)])[0] == exit_codes.HOSTS_FAILED
    assert logs([there, (PI, log(PI))])[0] == exit_codes.OK


def test_clocks_and_logs_that_are_cut_are_reported(logs: Callable[..., Any]) -> None:
    found = [(LAPTOP, log(LAPTOP, offset=-0.05)), (PI, log(PI, offset=2.5, cut=True))]
    assert logs(found, "--since", "10m")[2] == (
        f"note: {PI}: its clock is +2.5 s off; corrected\n"
        f"note: {PI}: there is more, only the newest are shown\n"
    )


@pytest.mark.parametrize(
    ("words", "error"),
    [(("--grep", "("), "--grep (: missing )"), (("--since", "soon"), "--since soon: not a time")],
)
def test_a_wrong_option_is_a_usage_error(
    logs: Callable[..., Any], words: tuple[str, ...], error: str
) -> None:
    status, _, err = logs([], *words)
    assert status == exit_codes.USAGE
    assert error in err


def test_following_names_a_lost_host_once_until_it_is_back(logs: Callable[..., Any]) -> None:
    found = [
        *[(LAPTOP, log(LAPTOP, (2.0, "b"))), (PI, log(PI, (1.0, "a"))), (PI, AWAY), (PI, AWAY)],
        *[(PI, log(PI, (3.0, "c"))), (LAPTOP, FAILED), (PI, FAILED)],
    ]
    status, shown, err = logs(found, "--follow")
    assert (status, shown) == (exit_codes.HOSTS_FAILED, ["a", "b", "c"])
    assert err == (
        f"{PI}  unreachable: no answer\n{PI}  connected again\n"
        f"{LAPTOP}  failed: {FAILED}\n  help: look\n{PI}  failed: {FAILED}\n  help: look\n"
    )


def test_following_ends_when_nobody_reads_it(
    logs: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    stdout = io.TextIOWrapper(io.BufferedWriter(streams.Output(writer, "w")))
    monkeypatch.setattr(sys, "stdout", stdout)
    assert logs([(LAPTOP, log(LAPTOP, (1.0, "a"))), (PI, log(PI))], "--follow")[0] == exit_codes.OK


class Interrupted(Exception):  # noqa: N818  (KeyboardInterrupt would end pytest)
    """What a handler raises."""


def test_ctrl_c_after_a_line_does_not_print_it_again() -> None:
    def interrupt(*_: object) -> None:
        raise Interrupted

    reader, writer = os.pipe()
    stdout = io.TextIOWrapper(io.BufferedWriter(streams.Output(writer, "w")))
    before = signal.signal(signal.SIGIO, interrupt)
    try:  # the write itself sends the signal
        fcntl.fcntl(reader, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(reader, fcntl.F_SETFL, os.O_ASYNC | os.O_NONBLOCK)
        for line in ("a", "b"):
            with pytest.raises(Interrupted):
                print(line, file=stdout, flush=True)
    finally:
        signal.signal(signal.SIGIO, signal.SIG_IGN)
        stdout.close()
        written = os.read(reader, 100)
        os.close(reader)
        signal.signal(signal.SIGIO, before)
    assert written == b"a\nb\n"
