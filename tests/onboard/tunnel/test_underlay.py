"""WireGuard over small packets, from another address, after a restart, and with an old clock."""

from __future__ import annotations

import base64
import subprocess
import sys
import time

import pytest

from tests.child_process import child_process
from tests.onboard.tunnel import test_tunnel
from tests.onboard.tunnel.initiation import initiation
from tests.onboard.tunnel.test_tunnel import Host, run, running
from tests.timing import PATIENCE, wait_for

pytestmark = test_tunnel.pytestmark
hosts = test_tunnel.hosts
DATAGRAM, STREAM = 20_000, 1_000_000  # bytes
RECEIVES = f"""
import socket
stream = socket.create_server(("", 7000))
datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
datagrams.bind(("", 7000))
stream.settimeout({PATIENCE})
datagrams.settimeout({PATIENCE})
print("ready", flush=True)
print(len(datagrams.recv(65535)), flush=True)
one, passed = stream.accept()[0], 0
one.settimeout({PATIENCE})
while passed < {STREAM}:
    passed += len(one.recv(65535))
print(passed, flush=True)
"""
SENDS = f"""
import socket, sys
at = (sys.argv[1], 7000)
if sys.argv[2] == "datagram":
    socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(bytes({DATAGRAM}), at)
else:
    one = socket.create_connection(at, {PATIENCE})
    one.sendall(bytes({STREAM}))
    one.recv(1)
"""


SHAKES = """
import base64, socket, sys
one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
one.bind(("", 51820))
one.settimeout(0.1)
for _ in range(20):
    one.sendto(base64.b64decode(sys.argv[2]), (sys.argv[1], 51820))
    try:
        print("answered" if one.recv(100)[0] == 2 else "")
        break
    except socket.timeout:
        pass
"""
YEAR = 365 * 86400  # s


def met(*hosts: Host) -> None:
    for one in hosts:
        one.meets(*(other for other in hosts if other is not one))


def accepts(host: Host, other: Host, seconds: float) -> bool:
    """Whether ``host`` answers a handshake of ``other`` that has this time."""
    message = initiation(other.key.read_text(), host.public, int(seconds))
    return "answered" in other.run(sys.executable, "-c", SHAKES, host.at, base64.b64encode(message).decode())


@pytest.mark.parametrize("mtus", [(1500, 1500), (1400, 1400), (1500, 1400), (1400, 1500)])
def test_large_messages_pass_where_packets_are_small(hosts: list[Host], mtus: tuple[int, int]) -> None:
    first, second, _ = hosts
    met(first, second)
    for one, mtu in zip((first, second), mtus, strict=True):
        run("ip", "-n", one.name, "link", "set", "eth0", "mtu", str(mtu))
    with running(first, second):
        wait_for(lambda: first.reaches(second), complaint="no packet passes")
        argv = ["ip", "netns", "exec", second.name, sys.executable, "-c", RECEIVES]
        with child_process(argv, stdout=subprocess.PIPE) as receiver:
            assert receiver.stdout is not None
            assert receiver.stdout.readline() == "ready\n"
            first.run(sys.executable, "-c", SENDS, second.inside, "datagram")
            assert receiver.stdout.readline() == f"{DATAGRAM}\n"
            first.run(sys.executable, "-c", SENDS, second.inside, "stream")
            assert receiver.stdout.readline() == f"{STREAM}\n"


@pytest.mark.slow
def test_a_host_with_another_address_is_followed(hosts: list[Host]) -> None:
    """Its peer sends to where the last packet came from, whatever the spec says."""
    first, second, _ = hosts
    met(first, second)
    with running(first, second):
        wait_for(lambda: first.reaches(second), complaint="no packet passes")
        run("ip", "-n", second.name, "address", "delete", f"{second.at}/24", "dev", "eth0")
        run("ip", "-n", second.name, "address", "add", "192.168.99.77/24", "dev", "eth0")
        wait_for(lambda: second.reaches(first), complaint="its own packets do not pass")
        assert first.reaches(second)


def test_hosts_that_start_again_meet_again(hosts: list[Host]) -> None:
    """One alone, then both: their keys and sessions are new."""
    first, second, _ = hosts
    met(first, second)
    for _ in range(2):
        with running(first):
            for _ in range(2):
                with running(second):
                    wait_for(lambda: first.reaches(second), complaint="no packet passes")
                    wait_for(lambda: second.reaches(first), complaint="no packet passes")


@pytest.mark.slow
def test_the_peer_of_a_host_with_an_old_clock_begins(hosts: list[Host]) -> None:
    """It refuses the host's handshakes until their time is later than before; the host answers its own."""
    first, second, _ = hosts
    met(first, second)
    now = time.time()
    with running(first):
        with running(second):
            wait_for(lambda: first.reaches(second), complaint="no packet passes")
        wait_for(lambda: accepts(first, second, now + YEAR), complaint="no handshake")
        assert not accepts(first, second, now)
        assert accepts(first, second, now + YEAR + 1)
        with running(second):
            wait_for(lambda: first.reaches(second), complaint="no packet passes")
            assert second.reaches(first)
