"""``swarmctl exec`` as a person and a script see it; the hosts' answers are invented."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from swarmctl.cli import exit_codes
from swarmctl.remote import host_commands
from swarmctl.remote.host_commands import Ran
from swarmctl.remote.parallel_hosts import Finished, Note
from swarmctl.remote.transport import HostError, Kind, Target
from tests.in_process import swarmctl

SPEC = """\
version: 1
name: lab
hosts:
  pi-[1-3]: {address: "10.0.0.[1-3]"}
  laptop: {address: 10.0.0.9}
robots:
  r1: {type: unknown-type, host: laptop}
"""
AWAY = HostError(Kind.UNREACHABLE, "no route to host")
LOST = HostError(Kind.LOST, "the connection was lost", "run `swarmctl trust SPEC`")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "swarm.yaml").write_text(SPEC)
    return tmp_path


def answers(monkeypatch: pytest.MonkeyPatch, *laptop_first: Any) -> list[Any]:
    """Hosts give these answers, the laptop before pi-1 to pi-3; returns what they were sent."""
    sent: list[Any] = []
    given = dict(zip(("laptop", "pi-1", "pi-2", "pi-3"), laptop_first, strict=False))

    def run(targets: list[Target], command: str, *_: Any, follow: bool, **__: Any) -> Iterator[Any]:
        names = [one.host for one in targets]
        sent.append((names, command, follow))
        for host, one in given.items():
            if one is KeyboardInterrupt:
                raise KeyboardInterrupt
            if host in names:
                if follow:
                    yield Note(host, "! \x1b[1mloud")
                yield Finished(host, one if isinstance(one, HostError) else Ran(host, *one), 1.0)

    monkeypatch.setattr(host_commands, "run", run)
    return sent


@pytest.mark.parametrize(
    ("laptop", "one", "code"),
    [
        ((0,), (0,), exit_codes.OK),
        ((9,), (9,), 9),
        ((0,), (9,), 9),
        ((8,), (9,), exit_codes.HOSTS_FAILED),
        (AWAY, (0,), exit_codes.HOSTS_UNREACHABLE),
        (AWAY, (9,), exit_codes.HOSTS_FAILED),
        (LOST, (0,), exit_codes.HOSTS_FAILED),
        (LOST, AWAY, exit_codes.HOSTS_FAILED),
    ],
)
def test_the_exit_code_is_that_of_the_command_if_hosts_agree(
    folder: Path, monkeypatch: pytest.MonkeyPatch, laptop: Any, one: Any, code: int
) -> None:
    answers(monkeypatch, laptop, one)
    assert swarmctl("exec", "swarm.yaml", "laptop,pi-1", "--", "x", cwd=folder).returncode == code
    assert swarmctl("exec", "laptop,pi-1", "--json", "--", "x", cwd=folder).returncode == code


def test_equal_output_stands_once_in_the_order_of_the_spec(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cut = Ran("pi-2", None, b"begun\n", error=LOST)
    same = (1, b"a\tb\n\x1b[2Jc", b"e\r\n")
    answers(monkeypatch, AWAY, same, (None, cut.stdout, b"", LOST), same)
    assert swarmctl("exec", "all", "--", "x", cwd=folder).stdout == (
        "pi-[1,3] (2 hosts), exit code 1\n"
        "    a b\n"
        "    \\x1b[2Jc\n"
        "    ! e\n"
        "pi-2, cut off\n"
        "    begun\n"
        "pi-2  lost: the connection was lost\n"
        "  help: run `swarmctl trust`\n"
        "laptop  unreachable: no route to host\n"
    )


def test_followed_lines_stand_after_their_host(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch, (0,), (2,))
    assert swarmctl("exec", "r1,pi-1", "-f", "--", "x", cwd=folder).stdout == (
        "laptop: ! \\x1b[1mloud\npi-1: ! \\x1b[1mloud\npi-1, exit code 2\n"
    )


def test_json_has_every_host(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch, AWAY, (1, b"\xff\n", b"e"))
    found = json.loads(swarmctl("exec", "laptop,pi-1", "--json", "--", "x", cwd=folder).stdout)
    away = {"kind": "unreachable", "message": "no route to host", "hint": ""}
    assert found == {
        "v": 1,
        "swarm": "lab",
        "hosts": [
            {"host": "pi-1", "status": 1, "stdout": "\ufffd\n", "stderr": "e", "error": None},
            {"host": "laptop", "status": None, "stdout": "", "stderr": "", "error": away},
        ],
    }


def test_ctrl_c_shows_who_was_done(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers(monkeypatch, (0, b"fine\n"), KeyboardInterrupt)
    done = swarmctl("exec", "all", "--", "x", cwd=folder)
    assert done.returncode == exit_codes.INTERRUPTED
    assert done.stdout == "laptop\n    fine\n"
    assert "interrupted: the command was ended on pi-[1-3]" in done.stderr


@pytest.mark.parametrize(
    ("words", "hosts", "command"),
    [
        (("all", "--", "ls -l | wc"), ["pi-1", "pi-2", "pi-3", "laptop"], "ls -l | wc"),
        (("!laptop", "--", "ls", "-l", "a b"), ["pi-1", "pi-2", "pi-3"], "ls -l 'a b'"),
        (("type:unknown-type", "--", "-f", "--json"), ["laptop"], "-f --json"),
        (("--file", "swarm.yaml", "pi-[1-2]", "--", "x"), ["pi-1", "pi-2"], "x"),
    ],
)
def test_the_selection_and_the_command_are_as_written(
    folder: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], hosts: list[str], command: str
) -> None:
    sent = answers(monkeypatch)
    swarmctl("exec", *words, cwd=folder)
    assert sent == [(hosts, command, False)]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("pi-1", "pi-2", "--", "ls"), "select several as one word: `pi-1,pi-2`"),
        (("all", "-f", "--json", "--", "ls"), "--follow and --json exclude each other"),
    ],
)
def test_what_is_not_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], message: str
) -> None:
    sent = answers(monkeypatch)
    done = swarmctl("exec", *words, cwd=folder)
    assert (done.returncode, sent) == (exit_codes.USAGE, [])
    assert message in done.stderr
