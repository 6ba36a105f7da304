"""Hosts that stall, flood or vanish: at whichever step, the error says so and comes in time."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from swarmctl.remote.identities import Keyring
from swarmctl.remote.ssh import SshTransport, Timeouts
from swarmctl.remote.transport import HostError, Kind, Target
from tests.remote import sshd as servers
from tests.remote.captured_wire import proxy
from tests.remote.sshd import Sshd
from tests.timing import PATIENCE, at_most


def test_wherever_a_host_stalls_the_error_says_so_in_time(sshd: Sshd, transport: SshTransport) -> None:
    with proxy(sshd.port) as way, transport.connect(sshd.target(port=way.port)):
        whole = way.down  # bytes that a login takes
    steps = [*range(0, whole, whole // 7), whole - 40, whole]
    limit = 1.5
    short = SshTransport(Keyring(Path("/nowhere"), use_agent=False), timeouts=Timeouts(*[limit] * 4))

    def stall(after: int) -> tuple[HostError, float]:
        with proxy(sshd.port, silent_after=after) as way:
            begun = time.monotonic()
            with pytest.raises(HostError) as caught, short.connect(sshd.target(port=way.port)) as session:
                servers.run(session, "true", timeout=limit)
            return caught.value, time.monotonic() - begun

    with ThreadPoolExecutor(len(steps)) as threads:
        found = list(threads.map(stall, steps))

    for error, seconds in found:
        assert error.retryable
        assert re.search(
            "no SSH banner|does not finish the SSH handshake|stopped answering|did not fin", str(error)
        )
        assert str(error).startswith("pi ")
        assert "overloaded or hung" in error.hint
        assert seconds < at_most(4 * limit)
    assert len({re.sub("[0-9]+", "", error.message) for error, _seconds in found}) >= 3


@pytest.mark.parametrize("flood", [b"x" * 5000 + b"\r\n", b"x" * 65536], ids=["lines", "one line"])
def test_an_endless_banner_is_cut_off(flood: bytes) -> None:
    impatient = SshTransport(Keyring(Path("/nowhere"), use_agent=False), timeouts=Timeouts(*[0.5] * 4))
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
        begun = time.monotonic()
        with pytest.raises(HostError) as caught, impatient.connect(Target("pi", "127.0.0.1", "root", port)):
            pass
        error = caught.value
        pouring.join(PATIENCE)
        assert not pouring.is_alive()

    assert time.monotonic() - begun < at_most(8)
    assert error.kind is Kind.UNREACHABLE
    assert error.message.startswith(f"pi (127.0.0.1, port {port})")
    assert len(error.message) < 300


CUT_OFF = """
import subprocess, sys, threading, time
from pathlib import Path
from swarmctl.remote.identities import Keyring
from swarmctl.remote.ssh import SshTransport, Timeouts
from swarmctl.remote.transport import HostError
from tests.remote import sshd as servers

subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
keyring = Keyring(Path("/nowhere"), use_agent=False)
transport = SshTransport(keyring, timeouts=Timeouts(acknowledgement=1.5))
with servers.running(Path(sys.argv[1])) as server, transport.connect(server.target()) as session:
    servers.run(session, "true")
    cut = threading.Timer(0.3, subprocess.run, [["ip", "link", "set", "lo", "down"]])
    cut.start()
    begun = time.monotonic()
    try:
        servers.run(session, "cat >/dev/null", [b"x" * 50_000_000], timeout=600)
    except HostError as error:
        print(error.kind.value, round(time.monotonic() - begun), error.message)
"""


OUTAGE = """
import subprocess, sys, threading, time
from pathlib import Path
from swarmctl.remote.identities import Keyring
from swarmctl.remote.ssh import SshTransport
from tests.remote import sshd as servers

def outage():
    for state in ("down", "up"):
        subprocess.run(["ip", "link", "set", "lo", state], check=True)
        time.sleep(3)

subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
transport = SshTransport(Keyring(Path("/nowhere"), use_agent=False))
with servers.running(Path(sys.argv[1])) as server, transport.connect(server.target()) as session:
    servers.run(session, "true")
    threading.Timer(0.3, outage).start()
    begun = time.monotonic()
    done = servers.run(session, "head -c 50000000 | wc -c", [b"x" * 50_000_000], timeout=60)
    print(done.stdout.decode().strip(), int(time.monotonic() - begun))
"""


@pytest.mark.skipif(not shutil.which("unshare"), reason="needs unshare (util-linux)")
def test_an_upload_completes_though_the_network_is_away_for_3_s(spare: Path) -> None:
    # In a network of its own, which ends with it.
    done = subprocess.run(
        ["unshare", "--net", sys.executable, "-c", OUTAGE, str(spare)],
        cwd=Path(__file__).parents[2], text=True, capture_output=True, timeout=PATIENCE, check=True,
    )  # fmt: skip
    received, seconds = done.stdout.split()
    assert received == "50000000"
    assert int(seconds) >= 3, "the network went after the upload"


@pytest.mark.skipif(not shutil.which("unshare"), reason="needs unshare (util-linux)")
def test_a_network_that_goes_amid_an_upload_ends_it_soon(spare: Path) -> None:
    # In a network of its own, which ends with it. The upload itself may take 10 minutes.
    done = subprocess.run(
        ["unshare", "--net", sys.executable, "-c", CUT_OFF, str(spare)],
        cwd=Path(__file__).parents[2], text=True, capture_output=True, timeout=PATIENCE, check=True,
    )  # fmt: skip
    kind, seconds, message = done.stdout.split(maxsplit=2)
    assert (kind, message.startswith("pi: the connection was lost")) == ("lost", True)
    assert int(seconds) < at_most(6)
