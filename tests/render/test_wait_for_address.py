"""``wait-for-address``: a master starts once it can listen, not on `network-online.target`."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from swarmctl import resources
from tests.ports import free_port
from tests.timing import PATIENCE, wait_for

PROGRAM = resources.templates() / "os/wait-for-address"
HOUR = 3600.0  # s, beyond all patience


def argv(address: str, port: int, within: float) -> list[str]:
    options = ["--port", str(port), "--unit", "swarm-test.master.service", "--within", str(within)]
    return [sys.executable, str(PROGRAM), address, *options]


def wait(address: str, port: int, within: float = 0.1) -> tuple[int, str]:
    command = argv(address, port, within)
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
    assert text.endswith(": this ROS master starts when it is free")


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
