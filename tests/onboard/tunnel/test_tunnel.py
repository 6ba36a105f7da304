"""The WireGuard of a host, by the program that runs there: hosts are network namespaces on one cable."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from swarm_onboard.tunnel.keys import joined, line

from swarmctl.resources import onboard
from tests.child_process import child_process
from tests.timing import PATIENCE, wait_for

PROGRAM = onboard() / "nodes/tunnel/tunnel.py"
MISSING = [one for one in ("ip", "wg", "wireguard-go") if shutil.which(one) is None]
pytestmark = [
    pytest.mark.skipif(os.geteuid() != 0, reason="needs root"),
    pytest.mark.skipif(bool(MISSING), reason=f"needs {', '.join(MISSING)}"),
    pytest.mark.skipif(not Path("/dev/net/tun").exists(), reason="needs /dev/net/tun"),
]
LEFT = ("type", "veth", "peer", "name", "left")  # every kernel has it
LISTENS = "import socket; server = socket.create_server(('', 7000)); one = server.accept()[0]\n"
LISTENS += "while True: one.sendall(one.recv(100))"
KNOCKS = """
import socket, sys
try:
    socket.create_connection((sys.argv[1], 9), 1)
except ConnectionRefusedError:
    print("refused")
except OSError:
    pass
"""
CONNECTS = """
import socket, sys
while True:
    try:
        one = socket.create_connection((sys.argv[1], 7000), 1)
        break
    except OSError:
        continue
one.settimeout(60)
for line in sys.stdin:
    one.sendall(line.encode())
    print(one.recv(100).decode(), end="", flush=True)
"""


class Host:
    """A namespace with an address on the cable: a host with a key, its peers, and the keys it knows."""

    def __init__(self, number: int, folder: Path) -> None:
        self.name = f"swarm-tun{number}-{os.getpid()}"
        # User space has one folder of sockets for all namespaces: names differ.
        self.interface = f"wg-{os.getpid() % 10**7}-{number}"
        self.at, self.inside = f"192.168.99.{number}", f"10.99.0.{number}"
        self.current, self.key = folder / f"current{number}", folder / f"key{number}"
        self.known = folder / f"known{number}"
        self.relays = False
        self.key.write_text(run("wg", "genkey"))
        self.public = run("wg", "pubkey", given=self.key.read_text()).strip()
        self.meets()

    def meets(self, *others: Host, port: int = 51820, behind: Sequence[Host] = ()) -> None:
        """``behind``: those that each of the others relays to."""
        inside = [one.inside for one in behind]
        listed = [
            {"name": one.name, "addresses": [one.inside, *inside], "endpoint": one.at} for one in others
        ]
        release = Path(tempfile.mkdtemp(dir=self.current.parent))
        (release / "peers.json").write_text(json.dumps({"port": port, "peers": listed}))
        (release / "link").symlink_to(release)
        (release / "link").replace(self.current)
        self.knows("".join(line(one.name, one.public) for one in others))

    def knows(self, lines: str) -> None:
        new = Path(f"{self.known}.new")
        new.write_text(joined(self.known.read_text() if self.known.exists() else "", lines))
        new.replace(self.known)

    @property
    def argv(self) -> list[str]:
        options = ("--interface", self.interface, "--address", f"{self.inside}/24")
        files = ("--peers", f"{self.current}/peers.json", "--keys", str(self.known), "--key", str(self.key))
        relay = ["--relay"] if self.relays else []
        return ["ip", "netns", "exec", self.name, sys.executable, str(PROGRAM), *options, *files, *relay]

    def run(self, *argv: str) -> str:
        return run("ip", "netns", "exec", self.name, *argv)

    def handshakes(self) -> set[str]:
        """The keys of those with whom there was one."""
        lines = self.run("wg", "show", self.interface, "latest-handshakes").splitlines()
        return {line.split()[0] for line in lines if line.split()[1] != "0"}

    def sent(self, other: Host) -> int:
        """The bytes for a peer since it is one."""
        lines = self.run("wg", "show", self.interface, "transfer").splitlines()
        return next(int(line.split()[2]) for line in lines if line.startswith(other.public))

    def reaches(self, other: Host) -> bool:
        """Whether the other one refuses a connection: nothing listens there."""
        return self.run(sys.executable, "-c", KNOCKS, other.inside) == "refused\n"


def run(*argv: str, given: str = "") -> str:
    done = subprocess.run(argv, input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@contextmanager
def namespace(name: str) -> Iterator[None]:
    run("ip", "netns", "add", name)
    try:
        yield
    finally:
        run("ip", "netns", "del", name)


@pytest.fixture
def hosts(tmp_path: Path) -> Iterator[list[Host]]:
    made = [Host(number, tmp_path) for number in (1, 2, 3)]
    bridge = f"swarm-sw-{os.getpid()}"
    with ExitStack() as stack:
        for name in (bridge, *(host.name for host in made)):
            stack.enter_context(namespace(name))
        run("ip", "-n", bridge, "link", "add", "br0", "type", "bridge")
        run("ip", "-n", bridge, "link", "set", "br0", "up")
        for number, host in enumerate(made):
            pair = ["type", "veth", "peer", "name", f"p{number}", "netns", bridge]
            run("ip", "-n", host.name, "link", "add", "eth0", *pair)
            run("ip", "-n", bridge, "link", "set", f"p{number}", "master", "br0", "up")
            run("ip", "-n", host.name, "address", "add", f"{host.at}/24", "dev", "eth0")
            run("ip", "-n", host.name, "link", "set", "eth0", "up")
        yield made


def begun(host: Host) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(onboard().parent)}
    return subprocess.Popen(host.argv, env=environment, stderr=subprocess.PIPE, text=True)


@contextmanager
def running(*hosts: Host) -> Iterator[list[subprocess.Popen[str]]]:
    """The program on each host; SIGTERM ends it, and no interface stays."""
    programs = [begun(host) for host in hosts]
    try:
        yield programs
    finally:
        for one in programs:
            one.terminate()
        statuses = [one.wait(PATIENCE) for one in programs]
    assert statuses == [0] * len(hosts)
    for host in hosts:
        assert "wg-" not in host.run("ip", "link", "show")


@contextmanager
def connection(host: Host, other: Host) -> Iterator[Callable[[str], bool]]:
    """One TCP connection through WireGuard; whether a line comes back over it."""
    listen = ["ip", "netns", "exec", other.name, sys.executable, "-c", LISTENS]
    connect = ["ip", "netns", "exec", host.name, sys.executable, "-c", CONNECTS, other.inside]
    pipe = subprocess.PIPE
    with child_process(listen), child_process(connect, stdin=pipe, stdout=pipe) as client:

        def echoes(text: str) -> bool:
            assert client.stdin is not None
            assert client.stdout is not None
            client.stdin.write(text)
            client.stdin.flush()
            return client.stdout.readline() == text

        yield echoes


def test_a_peer_that_joins_interrupts_nobody(hosts: list[Host]) -> None:
    first, second, third = hosts
    first.meets(second)
    second.meets(first)
    third.meets(first)
    with running(*hosts) as programs:
        wait_for(lambda: first.reaches(second), complaint="no packet passes")
        assert not third.reaches(first), "its key is not known there"
        with connection(first, second) as echoes:
            for text in ("before\n", "after\n"):
                assert echoes(text)
                before = first.sent(second)
                first.meets(second, third)
                wait_for(lambda: third.reaches(first), complaint="the third host stays outside")
                assert first.sent(second) >= before, "its session began anew"
    assert [one.stderr.read() for one in programs if one.stderr] == ["", "", ""]


def test_a_wrong_file_of_peers_changes_nothing(hosts: list[Host]) -> None:
    first, second, _ = hosts
    first.meets(second)
    second.meets(first)
    with running(first, second) as (program, _):
        wait_for(lambda: first.reaches(second), complaint="no packet passes")
        first.meets(second, port=-1)
        assert program.stderr is not None
        assert program.stderr.readline().endswith("the peers stay as they were\n")
        assert first.reaches(second)


def test_another_key_is_no_peer(hosts: list[Host]) -> None:
    first, second, third = hosts
    first.meets(second, third)
    second.meets(first)
    third.meets(first)
    second.key.write_text(run("wg", "genkey"))  # somebody else at its address
    with running(*hosts):
        wait_for(lambda: first.reaches(third), complaint="no packet passes")
        wait_for(lambda: first.sent(second) > 0, complaint="it never calls the second host")
        assert not first.reaches(second)
        assert first.handshakes() == {third.public}
        assert second.handshakes() == set()


def test_both_ends_change_their_keys_at_once(hosts: list[Host]) -> None:
    first, second, _ = hosts
    first.meets(second)
    second.meets(first)
    with running(first, second) as programs:
        wait_for(lambda: first.reaches(second), complaint="no packet passes")
        with connection(first, second) as echoes:
            new = {one: run("wg", "genkey") for one in (first, second)}
            public = {one: run("wg", "pubkey", given=key).strip() for one, key in new.items()}
            first.knows(line(second.name, public[second]))
            second.knows(line(first.name, public[first]))
            wait_for(lambda: public[second] in first.run("wg", "show", first.interface, "peers"))
            for one, key in new.items():
                (one.key.parent / "next").write_text(key)
                (one.key.parent / "next").replace(one.key)
            wait_for(lambda: public[second] in first.handshakes(), complaint="no handshake with the next key")
            first.knows(line(second.name, second.public, retired=True))
            second.knows(line(first.name, first.public, retired=True))
            wait_for(lambda: first.run("wg", "show", first.interface, "peers") == f"{public[second]}\n")
            assert echoes("after\n"), "the connection is the same"
    assert [one.stderr.read() for one in programs if one.stderr] == ["", ""]


@pytest.mark.parametrize("relays", [True, False])
def test_a_relay_carries_packets_from_one_peer_to_another(hosts: list[Host], relays: bool) -> None:
    relay, second, third = hosts
    relay.relays = relays
    relay.meets(second, third)
    second.meets(relay, behind=[third])
    third.meets(relay, behind=[second])
    with running(*hosts):
        wait_for(lambda: relay.reaches(second) and relay.reaches(third), complaint="no packet passes")
        assert second.reaches(third) is relays


def test_a_retired_key_is_no_peer(hosts: list[Host]) -> None:
    first, second, _ = hosts
    first.meets(second)
    second.meets(first)
    with running(first, second):
        wait_for(lambda: second.reaches(first), complaint="no packet passes")
        first.knows(line(second.name, second.public, retired=True))
        wait_for(lambda: first.run("wg", "show", first.interface, "peers") == "")
        assert not second.reaches(first)


def test_what_a_killed_run_left_is_replaced(hosts: list[Host]) -> None:
    first, second, _ = hosts
    first.meets(second)
    second.meets(first)
    run("ip", "-n", first.name, "link", "add", first.interface, *LEFT)
    with running(first, second):
        wait_for(lambda: first.reaches(second), complaint="no packet passes")


def test_it_ends_when_its_interface_is_gone(hosts: list[Host]) -> None:
    host = hosts[0]
    program = begun(host)
    wait_for(lambda: host.interface in host.run("ip", "link", "show", "up"), complaint="no interface")
    run("ip", "-n", host.name, "link", "delete", host.interface)
    _, printed = program.communicate(timeout=PATIENCE)
    assert program.returncode == 1
    assert printed.endswith(
        (f"the interface {host.interface} is gone\n", "wireguard-go has ended with status 0\n")
    )


def test_a_missing_key_is_named(hosts: list[Host]) -> None:
    hosts[0].key.unlink()
    program = begun(hosts[0])
    _, printed = program.communicate(timeout=PATIENCE)
    assert (program.returncode, printed) == (1, f"{hosts[0].key}: No such file or directory\n")
    assert "wg-" not in hosts[0].run("ip", "link", "show")
