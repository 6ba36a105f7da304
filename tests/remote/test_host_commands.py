"""A command on hosts: whatever happens to one host, the others have their output and their exit status."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import pytest

from swarmctl.remote import host_commands
from swarmctl.remote.host_commands import Ran
from swarmctl.remote.parallel_hosts import Finished, Note
from swarmctl.remote.transport import Kind, Target
from tests.ports import free_port
from tests.remote import sshd as servers
from tests.remote.conftest import AnySsh
from tests.remote.sshd import Sshd
from tests.timing import wait_for


def run(transport: AnySsh, targets: Sequence[Target], command: str) -> dict[str, Ran]:
    events = host_commands.run(targets, command, transport, parallel=8)
    results = [host_commands.ran(one) for one in events if isinstance(one, Finished)]
    return {one.host: one for one in results}


def lives(pid: int) -> bool:
    with suppress(ProcessLookupError):
        os.kill(pid, 0)
        return True
    return False


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("echo out; echo err >&2", (0, b"out\n", b"err\n")),
        ("printf 'no\\0end'; exit 7", (7, b"no\0end", b"")),
        ("exit 255", (255, b"", b"")),
        ("kill -TERM $$", (143, b"", b"Terminated\n")),
        ("cat", (0, b"", b"")),
        ("sleep 60 >/dev/null 2>&1 & echo on", (0, b"on\n", b"")),
        ("head -c 1000000 /dev/zero | tr '\\0' x", (0, b"x" * 1_000_000, b"")),
    ],
    ids=["streams", "code", "255", "signal", "no stdin", "background", "long"],
)
def test_a_command_has_its_output_and_its_status(
    sshd: Sshd, transport: AnySsh, command: str, expected: tuple[int, bytes, bytes]
) -> None:
    found = run(transport, [sshd.target()], command)["pi"]
    assert (found.status, found.stdout, found.stderr) == expected


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("yes", (Kind.FAILED, b"")),
        ("yes >&2", (Kind.FAILED, b"")),
        ("echo before; kill -9 $PPID; sleep 1", (Kind.FAILED, b"before\n")),
        ('echo before; sleep 1; kill -9 "$(ps -o ppid= -p $PPID)"; sleep 60', (Kind.LOST, b"before\n")),
    ],
    ids=["floods", "floods stderr", "killed", "dies"],
)
def test_a_host_that_fails_costs_its_own_result_alone(
    sshd: Sshd, spare: Path, transport: AnySsh, command: str, expected: tuple[Kind, bytes]
) -> None:
    with servers.running(spare) as bad:
        targets = [bad.target(), sshd.target(host="good"), bad.target(host="away", port=free_port())]
        choice = f'case $SSH_CONNECTION in *" {bad.port}") {command};; *) echo fine;; esac'
        found = run(transport, targets, choice)
    assert found["good"] == Ran("good", 0, b"fine\n")
    assert found["pi"].error is not None
    assert (found["pi"].error.kind, found["pi"].stdout) == expected
    assert found["away"].error is not None
    assert found["away"].error.kind is Kind.UNREACHABLE


def test_lines_are_there_as_they_come(sshd: Sshd, transport: AnySsh, tmp_path: Path) -> None:
    command = (
        f"echo one; until [ -e {tmp_path}/seen ]; do sleep 0.05; done; echo two >&2; printf thr\\\\303\\\\251"
    )
    seen = []
    for event in host_commands.run([sshd.target()], command, transport, parallel=1, follow=True):
        if isinstance(event, Note):
            seen.append(event.text)
            (tmp_path / "seen").touch()
        elif isinstance(event, Finished):
            assert event.outcome == Ran("pi", 0)
    assert seen == ["one", "! two", "thr\u00e9"]


def test_a_long_output_that_is_followed_is_whole(sshd: Sshd, transport: AnySsh) -> None:
    command = "seq 200000; exit 3"  # more than is kept of one that is not followed
    events = list(host_commands.run([sshd.target()], command, transport, parallel=1, follow=True))
    assert [one.text for one in events if isinstance(one, Note)] == [str(n + 1) for n in range(200_000)]
    assert isinstance(events[-1], Finished)
    assert events[-1].outcome == Ran("pi", 3)


@pytest.mark.parametrize("stubborn", ["", "trap '' TERM; "], ids=["", "stubborn"])
def test_the_command_ends_with_who_waits_for_it(sshd: Sshd, transport: AnySsh, stubborn: str) -> None:
    command = f"{stubborn}sleep 600 & echo $$ $!; wait; sleep 600"
    events = host_commands.run([sshd.target()], command, transport, parallel=1, follow=True)
    line = next(one.text for one in events if isinstance(one, Note))
    pids = [int(word) for word in line.split()]
    assert all(map(lives, pids))
    events.close()
    wait_for(lambda: not any(map(lives, pids)), complaint="the command outlives its connection")


def test_one_word_is_a_line_and_several_stay_as_they_are() -> None:
    assert host_commands.shell_command(["ps aux | grep ros"]) == "ps aux | grep ros"
    assert host_commands.shell_command(["ls", "a b", "$HOME"]) == "ls 'a b' '$HOME'"
