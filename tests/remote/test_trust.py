"""``swarmctl trust``: nothing is pinned that nobody looked at, and a changed key never slips in."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
import sshd as servers
from sshd import Sshd

from swarmctl.remote.hostkeys import LockFile, fingerprint, read_lock, write_lock

RUN = "import sys, typer; from swarmctl.cli.trust import trust; typer.run(trust)"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A home with an ssh configuration that leads the spec's address to loopback."""
    (tmp_path / "home/.ssh").mkdir(parents=True)
    return tmp_path / "home"


@pytest.fixture
def spec(tmp_path: Path, sshd: Sshd, home: Path) -> Path:
    path = tmp_path / "swarm.yaml"
    path.write_text(
        "version: 1\nname: new\nmode: leader\nleader: laptop\n"
        "hosts:\n"
        f"  laptop: {{address: 127.0.0.1, user: root, port: {sshd.port}}}\n"
        "robots:\n  koala: {type: koala, host: laptop}\n"
        "links:\n"
        "  - {kind: serial, host: laptop, robot: koala, usb: {serial: A6}}\n"
        "control:\n  - {by: laptop, of: [koala]}\n"
    )
    return path


def trust(spec: Path, home: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", RUN, str(spec), *options],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "HOME": str(home), "NO_COLOR": "1"},
        timeout=60,
    )


def pinned(spec: Path) -> dict[str, tuple[str, ...]]:
    return dict(read_lock(spec.with_name("swarm.lock.yaml")).hosts)


def test_without_a_terminal_nothing_is_pinned(spec: Path, home: Path, sshd: Sshd) -> None:
    done = trust(spec, home)

    assert done.returncode == 1
    assert fingerprint(sshd.keys[2]) in done.stdout
    assert "no terminal to ask on" in done.stderr
    assert "--yes" in done.stderr
    assert pinned(spec) == {}


def test_yes_pins_and_a_second_time_finds_nothing_new(spec: Path, home: Path, sshd: Sshd) -> None:
    first = trust(spec, home, "--yes")
    assert (first.returncode, pinned(spec)) == (0, {"laptop": (sshd.keys[2],)}), first.stderr
    before = spec.with_name("swarm.lock.yaml").stat().st_mtime_ns

    second = trust(spec, home)

    assert second.returncode == 0, second.stderr
    assert second.stdout.startswith("known ")
    assert spec.with_name("swarm.lock.yaml").stat().st_mtime_ns == before


def test_a_changed_key_is_pinned_only_when_told_to_replace_it(spec: Path, home: Path, sshd: Sshd) -> None:
    stale = servers.make_key(spec.parent / "stale")
    write_lock(spec.with_name("swarm.lock.yaml"), LockFile({"laptop": (stale,)}))

    refused = trust(spec, home, "--yes")

    assert refused.returncode == 1
    assert fingerprint(stale) in refused.stdout
    assert fingerprint(sshd.keys[2]) in refused.stdout
    assert "--host laptop --replace" in refused.stderr
    assert pinned(spec) == {"laptop": (stale,)}

    assert trust(spec, home, "--host", "laptop", "--replace", "--yes").returncode == 0
    assert pinned(spec) == {"laptop": (sshd.keys[2],)}


def test_an_unknown_host_and_an_absent_one(spec: Path, home: Path) -> None:
    unknown = trust(spec, home, "--host", "nobody")
    assert unknown.returncode == 1
    assert "has no host nobody" in unknown.stderr

    (home / ".ssh/config").write_text(
        f"Host laptop\n HostName 127.0.0.1\n ProxyJump 127.0.0.1:{servers.free_port()}\n"
    )
    absent = trust(spec, home, "--yes")
    assert absent.returncode == 4
    assert "nothing listens for SSH there" in absent.stderr


def test_a_wrong_lock_file_is_an_error_with_its_place(spec: Path, home: Path) -> None:
    spec.with_name("swarm.lock.yaml").write_text("version: 1\nhost: {}\n")
    done = trust(spec, home)
    assert done.returncode == 1
    assert "swarm.lock.yaml:2:1: the file knows no `host`" in done.stderr


def test_a_host_behind_another_is_seen_through_it(spec: Path, home: Path, sshd: Sshd, tmp_path: Path) -> None:
    with servers.running(tmp_path / "gate") as gate:
        (home / ".ssh/config").write_text(
            f"Host laptop\n ProxyJump root@gate\nHost gate\n HostName 127.0.0.1\n Port {gate.port}\n"
            f" IdentityFile {gate.identity}\n"
        )
        done = trust(spec, home, "--yes")
    assert done.returncode == 0, done.stderr
    assert pinned(spec) == {"gate": (gate.keys[0],), "laptop": (sshd.keys[2],)}


@pytest.fixture
def terminal(spec: Path, home: Path) -> Iterator[tuple[int, int]]:
    """``trust`` on a terminal of its own: process id and the terminal's other end."""
    pid, master = pty.fork()
    if pid == 0:
        os.environ["HOME"] = str(home)
        os.execv(sys.executable, [sys.executable, "-c", RUN, str(spec)])
    yield pid, master
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
    os.close(master)


def _answer(terminal: tuple[int, int], answer: str) -> int:
    """Wait for the question, answer it, and return the exit code."""
    pid, master = terminal
    seen = b""
    end = time.monotonic() + 30
    while b": " not in seen.partition(b"type yes to pin 1 key")[2]:
        assert time.monotonic() < end, seen
        if select.select([master], [], [], 0.2)[0]:
            seen += os.read(master, 4096)
    os.write(master, answer.encode() + b"\n")
    while time.monotonic() < end:
        if select.select([master], [], [], 0.2)[0]:
            try:
                if not os.read(master, 4096):
                    break
            except OSError:  # how Linux says that the other end of a terminal is gone
                break
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


@pytest.mark.parametrize(("answer", "status"), [("yes", 0), ("y", 1), ("", 1)])
def test_on_a_terminal_it_asks_and_takes_only_the_whole_word(
    terminal: tuple[int, int], spec: Path, answer: str, status: int
) -> None:
    assert _answer(terminal, answer) == status
    assert bool(pinned(spec)) is (status == 0)
