"""Hosts that stall, flood or vanish: at whichever step, a limit ends the wait and the error says so."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from swarmctl.remote.ssh_limits import Timeouts
from swarmctl.remote.transport import HostError, Kind, Target
from tests.remote import sshd as servers
from tests.remote.captured_wire import proxy
from tests.remote.conftest import AnySsh, MakeTransport
from tests.remote.sshd import Sshd
from tests.timing import PATIENCE


def test_wherever_a_host_stalls_it_is_given_up_on(sshd: Sshd, transport: AnySsh, make: MakeTransport) -> None:
    """The host says nothing more, ever: only a limit ends a wait for it."""
    with proxy(sshd.port) as way, transport.connect(sshd.target(port=way.port)):
        whole = way.down  # bytes that a login takes
    steps = [*range(0, whole, whole // 7), whole - 40, whole]

    def stall(after: int, limit: float) -> HostError:
        short = make(timeouts=Timeouts(*[limit] * 4))
        with proxy(sshd.port, silent_after=after) as way:
            with pytest.raises(HostError) as caught, short.connect(sshd.target(port=way.port)) as session:
                servers.run(session, "true", timeout=limit)
            return caught.value

    for limit in (1.5, 6.0, 24.0):  # a busy machine may not come beyond the first step in a short one
        with ThreadPoolExecutor(len(steps)) as threads:
            found = list(threads.map(stall, steps, [limit] * len(steps)))
        kinds = {re.sub("[0-9]+", "", error.message) for error in found}
        if len(kinds) >= 3:
            break

    for error in found:
        assert error.retryable
        assert re.search(
            "no SSH banner|does not finish the SSH handshake|stopped answering|did not fin", str(error)
        )
        assert str(error).startswith("pi ")
        assert "overloaded or hung" in error.hint
    assert len(kinds) >= 3


def test_a_connection_that_ends_before_the_login_is_named(
    sshd: Sshd, tmp_path: Path, make: MakeTransport
) -> None:
    once, stranger = make(attempts=1), tmp_path / "stranger"
    servers.make_key(stranger)
    with proxy(sshd.port) as way:
        with pytest.raises(HostError), once.connect(sshd.target(port=way.port, identities=(stranger,))):
            raise AssertionError("it logged in")
        refused = way.down  # bytes: of a login, an unknown number may come after its end
    begun = sshd.log.count("session opened")

    def end(after: int) -> HostError:
        with proxy(sshd.port, silent_after=after, ends=True) as way:
            with pytest.raises(HostError) as caught, once.connect(sshd.target(port=way.port)):
                raise AssertionError("it logged in")
            return caught.value

    for error in map(end, (0, 20, refused // 2, refused - 60)):
        assert re.search("^pi .*closed the connection", str(error)), str(error)
    assert sshd.log.count("session opened") == begun


@pytest.mark.parametrize("flood", [b"x" * 5000 + b"\r\n", b"x" * 65536], ids=["lines", "one line"])
def test_an_endless_banner_is_cut_off(flood: bytes, make: MakeTransport) -> None:
    impatient = make(timeouts=Timeouts(*[0.5] * 4))
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]

        def pour() -> None:
            with suppress(OSError):
                connection, _ = listener.accept()
                with connection:
                    while True:
                        connection.sendall(flood)

        pouring = threading.Thread(target=pour, daemon=True)
        pouring.start()
        with pytest.raises(HostError) as caught, impatient.connect(Target("pi", "127.0.0.1", "root", port)):
            pass
        error = caught.value
        pouring.join(PATIENCE)
        assert not pouring.is_alive()

    assert error.kind is Kind.UNREACHABLE
    assert error.message.startswith(f"pi (127.0.0.1, port {port})")
    assert len(error.message) < 300


# In a network of its own, which ends with it; each transport sends at the same time.
SETUP = """
import subprocess, sys, threading, time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from swarmctl.remote.ssh_limits import Timeouts
from swarmctl.remote.transport import HostError
from tests.remote import sshd as servers
from tests.remote.conftest import with_openssh, with_paramiko

MAKERS = (with_paramiko, with_openssh)
ready = threading.Barrier(len(MAKERS) + 1)

def link(state):
    subprocess.run(["ip", "link", "set", "lo", state], check=True)

def run(use, change):
    link("up")
    with servers.running(Path(sys.argv[1])) as server, ThreadPoolExecutor() as threads:
        tasks = [threads.submit(use, make, server) for make in MAKERS]
        ready.wait()
        time.sleep(0.3)
        change()
        for task in tasks:
            print(task.result())
"""
CUT_OFF = f"""{SETUP}
def use(make, server):
    with make(timeouts=Timeouts(acknowledgement=1.5)).connect(server.target()) as session:
        servers.run(session, "true")
        ready.wait()
        try:
            servers.run(session, "cat >/dev/null", [b"x" * 100_000_000], timeout=600)
        except HostError as error:
            return f"{{error.kind.value}} {{error.message}}"

run(use, lambda: link("down"))
"""
OUTAGE = f"""{SETUP}
def use(make, server):
    with make().connect(server.target()) as session:
        servers.run(session, "true")
        ready.wait()
        begun = time.monotonic()
        done = servers.run(session, "head -c 100000000 | wc -c", [b"x" * 100_000_000], timeout={PATIENCE})
        return f"{{done.stdout.decode().strip()}} {{time.monotonic() - begun:.1f}}"

def outage():
    link("down")
    time.sleep(3)
    link("up")

run(use, outage)
"""


def in_a_network_of_its_own(script: str, folder: Path) -> list[str]:
    done = subprocess.run(
        ["unshare", "--net", sys.executable, "-c", script, str(folder)],
        cwd=Path(__file__).parents[2], text=True, capture_output=True, timeout=PATIENCE, check=True,
    )  # fmt: skip
    return done.stdout.splitlines()


@pytest.mark.skipif(not shutil.which("unshare"), reason="needs unshare (util-linux)")
def test_an_upload_completes_though_the_network_is_away_for_3_s(spare: Path) -> None:
    lines = in_a_network_of_its_own(OUTAGE, spare)
    assert len(lines) == 2
    for line in lines:
        received, seconds = line.split()
        assert received == "100000000"
        assert float(seconds) >= 3, "the network went after the upload"


@pytest.mark.skipif(not shutil.which("unshare"), reason="needs unshare (util-linux)")
def test_a_network_that_goes_amid_an_upload_ends_it(spare: Path) -> None:
    lines = in_a_network_of_its_own(CUT_OFF, spare)  # the upload itself may take longer than that runs
    assert len(lines) == 2
    for line in lines:
        assert line.startswith("lost pi: the connection was lost")
