"""``wait-for-address``: a master starts once it can listen, not on `network-online.target`."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest

from swarmctl import resources
from tests.child_process import child_process
from tests.ports import free_port
from tests.timing import PATIENCE, wait_for

PROGRAM = resources.templates() / "os/wait-for-address"
HOUR = 3600.0  # s, beyond all patience
FOREIGN = 100_000 + os.getpid()  # that of no other test: all its processes may be ended
NEEDS_ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="needs root")
HELD = ("--owner", "nobody", "--hold", "127.0.0.1")


def argv(address: str, port: int | str, within: float, *more: str) -> list[str]:
    options = ["--port", str(port), "--unit", "swarm-test.master.service", "--within", str(within)]
    return [sys.executable, str(PROGRAM), address, *options, *more]


def wait(address: str, port: int | str, within: float = 0.1, *more: str) -> tuple[int, str]:
    command = argv(address, port, within, *more)
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    return done.returncode, done.stderr.strip()


@pytest.fixture(autouse=True)
def restarts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The ``systemctl`` of the host; the unit was restarted once."""
    path = tmp_path / "systemctl"
    path.write_text("#!/bin/sh\necho 1\n")
    path.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    return path


@pytest.fixture
def port() -> int:
    """A port on which nothing listens."""
    return free_port()


@pytest.mark.parametrize("address", ["127.0.0.1", "localhost"])
def test_an_address_of_this_host_is_found_at_once(address: str, port: int) -> None:
    assert wait(address, port) == (0, "")


@pytest.mark.parametrize("address", ["192.0.2.7", "2001:db8::7", "no-such-host.invalid"])
def test_another_is_waited_for_and_then_named(address: str, port: int) -> None:
    assert wait(address, port) == (1, f"this host has no address {address} after 0.1 s")


def test_who_has_the_port_is_named_before_the_time_is_up() -> None:
    me = f"process {os.getpid()} ({Path('/proc/self/comm').read_text().strip()})"
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        code, text = wait("127.0.0.1", port)
    assert code == 1
    assert text.startswith(f"port {port} is in use by {me}")
    assert text.endswith(": swarm-test.master.service starts when it is free")


def test_a_first_start_fails_soon(restarts: Path) -> None:
    """A deploy is not to wait for a master that somebody has forgotten."""
    restarts.write_text("#!/bin/sh\necho 0\n")
    with socket.create_server(("127.0.0.1", 0)) as other:
        assert wait("127.0.0.1", other.getsockname()[1], HOUR)[0] == 1


def test_a_port_that_is_given_up_is_found_free(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with socket.create_server(("127.0.0.1", 0)) as other, log.open("w") as file:
        waiting = subprocess.Popen(argv("127.0.0.1", other.getsockname()[1], HOUR), stderr=file)
        wait_for(lambda: "is in use by" in log.read_text())
        other.close()
        assert waiting.wait(PATIENCE) == 0


def test_a_stop_of_the_unit_ends_the_wait_without_failure(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with socket.create_server(("127.0.0.1", 0)) as other, log.open("w") as file:
        waiting = subprocess.Popen(argv("127.0.0.1", other.getsockname()[1], HOUR), stderr=file)
        wait_for(lambda: "is in use by" in log.read_text())
        waiting.terminate()
        assert waiting.wait(PATIENCE) == 0


def test_a_master_that_has_just_ended_has_left_its_port(port: int) -> None:
    """Its last connections remain for a minute in TIME_WAIT, which rosmaster ignores as well."""
    here = ("127.0.0.1", port)
    with socket.create_server(here) as server, socket.create_connection(here) as client:
        accepted, _ = server.accept()
        accepted.close()
        client.recv(1)
    assert wait("127.0.0.1", port) == (0, "")


# With --hold


class Kept:
    """What systemd gets at its socket: names of sockets, and the sockets."""

    def __init__(self, path: Path) -> None:
        self._channel = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._channel.bind(str(path))
        self._channel.setblocking(False)
        self._found: dict[str, socket.socket] = {}

    def all(self) -> dict[str, socket.socket]:
        with suppress(BlockingIOError):
            while True:
                text, files, _, _ = socket.recv_fds(self._channel, 4096, 4)
                assert text.startswith(b"FDSTORE=1\nFDNAME=")
                self._found[text.partition(b"FDNAME=")[2].decode()] = socket.socket(fileno=files[0])
        return self._found

    def close(self) -> None:
        for one in (self._channel, *self._found.values()):
            one.close()


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Kept]:
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    made = Kept(tmp_path / "notify")
    yield made
    made.close()


#: Takes a port again and again, in a new process each time, until its parent has ended.
TAKES = """
import os, socket, sys, time
parent = os.getpid()
while True:
    if os.fork():
        os.wait()
        continue
    while os.getppid() == parent:
        try:
            place = sys.argv[2], int(sys.argv[3])
            if sys.argv[1] == "tcp":
                one = socket.create_server(place)
            else:
                family = socket.AF_INET6 if ":" in place[0] else socket.AF_INET
                one = socket.socket(family, socket.SOCK_DGRAM)
                one.bind(place)
        except OSError:
            continue
        print("taken", flush=True)
        while os.getppid() == parent:
            time.sleep(0.1)
    os._exit(0)
"""


@contextmanager
def taking(
    port: int, account: int, address: str = "", *, protocol: str = "tcp"
) -> Iterator[subprocess.Popen[str]]:
    before = ["setpriv", f"--reuid={account}", f"--regid={account}", "--clear-groups"]
    argv = [*before, sys.executable, "-c", TAKES, protocol, address, str(port)]
    with child_process(argv, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "taken\n"
        yield process


def test_systemd_gets_a_socket_that_listens_at_each_place(kept: Kept, port: int) -> None:
    assert wait("127.0.0.1", port, HOUR, "--owner", "root", "--hold", "127.0.0.1", "127.0.1.1", "::1") == (
        0,
        "",
    )
    sockets = kept.all()
    assert sorted(sockets) == [f"..1-{port}", f"127.0.0.1-{port}", f"127.0.1.1-{port}"]
    for one in sockets.values():
        with socket.create_connection(one.getsockname()[:2], PATIENCE):
            pass


@NEEDS_ROOT
def test_an_account_that_takes_the_port_again_does_not_keep_it(kept: Kept, port: int) -> None:
    with taking(port, FOREIGN):
        code, text = wait("127.0.0.1", port, PATIENCE, *HELD)
        assert code == 0, text
        assert list(kept.all()) == [f"127.0.0.1-{port}"]
        assert f"port {port} was taken by account {FOREIGN}: ends process" in text


@NEEDS_ROOT
def test_an_account_that_had_the_port_before_is_ended(port: int) -> None:
    loader = SourceFileLoader("wait_for_address", str(PROGRAM))
    program = module_from_spec(spec_from_loader(loader.name, loader))  # type: ignore[arg-type]
    loader.exec_module(program)
    with taking(port, FOREIGN) as process:
        [holder] = program.holders(port)
        assert int(holder) != process.pid
        program.end_foreign(holder, port, set(), {FOREIGN})
        assert process.wait(PATIENCE) == -signal.SIGKILL


@NEEDS_ROOT
@pytest.mark.parametrize(
    ("protocol", "address", "taken"),
    [("tcp", "127.0.0.1", ""), ("udp", "127.0.0.1", ""), ("udp", "::1", "::1"), ("udp", "::1", "127.0.0.1")],
)
def test_a_unit_that_listens_itself_finds_the_port_free(
    protocol: str, address: str, taken: str, port: int
) -> None:
    argument = port if protocol == "tcp" else f"udp:{port}"
    with taking(port, FOREIGN, taken, protocol=protocol):
        assert wait(address, argument, 0.1)[0] == 1
        code, text = wait(address, argument, PATIENCE, "--owner", "nobody")
        assert (code, "ends process" in text) == (0, True), text


@NEEDS_ROOT
@pytest.mark.parametrize("account", [0, 65534, 61184], ids=["root", "the host's account", "a unit's"])
def test_who_may_have_it_is_named_and_goes_on(account: int, kept: Kept, port: int) -> None:
    with taking(port, account) as process:
        code, text = wait("127.0.0.1", port, 0.1, *HELD)
        assert (code, process.poll(), kept.all()) == (1, None, {})
        assert f"port {port} is in use by process" in text


@NEEDS_ROOT
def test_who_listens_elsewhere_at_that_port_goes_on(kept: Kept, port: int) -> None:
    with taking(port, FOREIGN, "127.9.9.9") as process:
        assert wait("127.0.0.1", port, HOUR, *HELD) == (0, "")
        assert process.poll() is None
