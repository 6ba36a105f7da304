"""The firewall with real packets: a host and its network in namespaces of their own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest

from swarmctl.swarm import names
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.child_process import child_process
from tests.loading import load_swarm
from tests.render.test_firewall import (
    DYNAMIC,
    EPHEMERAL,
    NEEDED,
    OTHER,
    USER,
    declared,
    ip,
    loaded,
    services,
    table_of,
)

pytestmark = NEEDED
STRANGER, SSH, MASTER, ELSE = "192.168.77.99", 22, 11311, 9090
Wanted = tuple[str, str, int]  # source, address and port of a connection
MOST_CALLS = 256

LISTENS = """
import select, socket, sys
ports = [socket.create_server(("", int(port)), backlog=2000) for port in sys.argv[1:]]
print("listens", flush=True)
kept = []
while True:
    kept += [one.accept() for one in select.select(ports, [], [])[0]]
"""
# Answers at each port with a byte: each datagram, and each connection, which it closes at once.
ANSWERS = """
import contextlib, select, socket, sys
kind = socket.SOCK_STREAM if sys.argv[1] == "tcp" else socket.SOCK_DGRAM
ports = [socket.socket(socket.AF_INET, kind) for _ in sys.argv[2:]]
for one, port in zip(ports, sys.argv[2:]):
    one.bind(("", int(port)))
    if kind == socket.SOCK_STREAM:
        one.listen(100)
print("listens", flush=True)
while True:
    for one in select.select(ports, [], [])[0]:
        with contextlib.suppress(OSError):
            if kind == socket.SOCK_DGRAM:
                one.sendto(*one.recvfrom(1))
            else:
                with one.accept()[0] as accepted:
                    accepted.send(b"x")
"""
# Prints the ports that answer within some tries.
ASKS = """
import json, socket, sys, threading
kind, source, to = sys.argv[1:4]
found = []
def ask(port):
    for _ in range(3):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM if kind == "tcp" else socket.SOCK_DGRAM) as one:
            one.settimeout(1)
            one.bind((source, 0))
            try:
                one.connect((to, port))
                if kind == "udp":
                    one.send(b"x")
                if one.recv(1):
                    return found.append(port)
            except OSError:
                pass
threads = [threading.Thread(target=ask, args=(int(port),)) for port in sys.argv[4:]]
for one in threads:
    one.start()
for one in threads:
    one.join()
print(json.dumps(found))
"""
# Opens all connections at once, and prints which are open once as many are as should be.
CONNECTS = """
import errno, json, selectors, socket, sys, time
wanted, expected = json.loads(sys.argv[1]), int(sys.argv[2])
selector, found, end = selectors.DefaultSelector(), [], time.monotonic() + 30
for source, to, port in wanted:
    one = socket.socket()
    one.setblocking(False)
    one.bind((source, 0))
    one.connect_ex((to, port))
    selector.register(one, selectors.EVENT_WRITE, (source, port))
while time.monotonic() < end:
    for key, _ in selector.select(0.5):
        selector.unregister(key.fileobj)
        if key.fileobj.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) == 0:
            found.append(key.data)
    if len(found) >= expected and end > time.monotonic() + 1:
        end = time.monotonic() + 1  # for those that should not be open
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def swarm(tmp_path_factory: pytest.TempPathFactory) -> Swarm:
    overlay = tmp_path_factory.mktemp("filtered") / "overlay.yaml"
    overlay.write_text("security: filtered\nmultimaster: {provider: fkie}\n", "utf-8")
    found, _ = load_swarm(ROOT / "examples/paper-4-standalone/swarm.yaml", overlay)
    assert found is not None
    return replace(found, hosts={name: replace(one, user="nobody") for name, one in found.hosts.items()})


class Cable:
    """A host and its network, each in a namespace."""

    def __init__(self) -> None:
        self.host, self.network = f"swarm-host-{os.getpid()}", f"swarm-net-{os.getpid()}"
        for name in (self.host, self.network):
            subprocess.run(["ip", "netns", "add", name], check=True)
        ip(
            self.host,
            *["ip", "link", "add", "eth0", "type", "veth", "peer", "name", "eth0", "netns"],
            self.network,
        )
        for name in (self.host, self.network):
            ip(name, "ip", "link", "set", "lo", "up")
            ip(name, "ip", "link", "set", "eth0", "up")

    def address(self, host: str, others: Iterable[str]) -> None:
        for name, addresses in ((self.host, (host,)), (self.network, others)):
            for one in addresses:
                ip(name, "ip", "address", "add", f"{one}/24", "dev", "eth0")

    @contextmanager
    def listening(
        self,
        ports: Iterable[int | str],
        *before: str,
        program: Sequence[str] = (LISTENS,),
        where: str = "",
    ) -> Iterator[None]:
        argv = [
            "ip",
            "netns",
            "exec",
            where or self.host,
            *before,
            sys.executable,
            "-c",
            *program,
            *map(str, ports),
        ]
        with child_process(argv, stdout=subprocess.PIPE) as listener:
            assert listener.stdout is not None
            assert listener.stdout.readline() == "listens\n"
            yield

    def remove(self) -> None:
        for name in (self.host, self.network):
            subprocess.run(["ip", "netns", "del", name], check=True)


@pytest.fixture
def cable() -> Iterator[Cable]:
    made = Cable()
    yield made
    made.remove()


def opened(namespace: str, wanted: list[Wanted], expected: int, *before: str) -> list[tuple[str, int]]:
    argv = [*before, sys.executable, "-c", CONNECTS, json.dumps(wanted), str(expected)]
    return [(source, port) for source, port in json.loads(ip(namespace, *argv))]


@pytest.mark.parametrize("name", ["koala-laptop", "k3-pi", "epuck-pi"])
def test_packets_pass_where_the_graph_has_a_flow(name: str, swarm: Swarm, cable: Cable) -> None:
    host = swarm.hosts[name]
    others = {one.address: one.name for one in swarm.hosts.values() if one is not host} | {STRANGER: ""}
    cable.address(host.address, others)
    loaded(cable.host, {"swarm-any": table_of(swarm, host)})
    ports = {port: one for (protocol, port), one in services(swarm, name).items() if protocol == "tcp"}
    every = (*ports, SSH, ELSE)
    wanted = [(source, host.address, port) for source in others for port in every]
    expected = {
        (source, port)
        for source, port in product(others, every)
        if port not in ports or declared(swarm, others[source], name, ports[port])
    }
    with cable.listening(every):
        assert set(opened(cable.network, wanted, len(expected))) == expected


def test_one_host_cannot_take_all_connections_of_a_master(swarm: Swarm, cable: Cable) -> None:
    host, other = swarm.hosts["koala-laptop"], swarm.hosts["k3-pi"].address
    cable.address(host.address, [other])
    loaded(cable.host, {"swarm-any": table_of(swarm, host)})
    with cable.listening([MASTER]):
        many = [(other, host.address, MASTER)] * (MOST_CALLS + 50)
        assert len(opened(cable.network, many, MOST_CALLS)) == MOST_CALLS


def test_another_account_reaches_no_master(swarm: Swarm, cable: Cable) -> None:
    host = swarm.hosts["koala-laptop"]
    second = "10.1.1.1"
    cable.address(host.address, ())
    ip(cable.host, "ip", "address", "add", f"{second}/24", "dev", "eth0")
    loaded(cable.host, {"swarm-any": table_of(swarm, host)})
    local = [(one, one, MASTER) for one in ("127.0.0.1", host.address, second)]
    local += [(host.address, host.address, port) for port in (EPHEMERAL[0], SSH)]
    with cable.listening([MASTER, EPHEMERAL[0], SSH]):
        assert len(opened(cable.host, local, len(local))) == len(local)
        assert opened(cable.host, local, 1, *as_account(OTHER)) == [(host.address, SSH)]


@pytest.mark.parametrize("cookies", [1, 2])
@pytest.mark.parametrize(("account", "is_unit"), [(0, True), (USER, True), (DYNAMIC, True), (OTHER, False)])
def test_only_units_answer_at_ports_of_ros(
    account: int, is_unit: bool, cookies: int, swarm: Swarm, cable: Cable
) -> None:
    """An account has taken the ports of the master, of nodes that ended and of the multimaster. With 2 Linux
    answers all callers by SYN cookies, in packets of nobody, as it does where a port is flooded."""
    host, other = swarm.hosts["koala-laptop"], swarm.hosts["k3-pi"].address
    cable.address(host.address, [other])
    loaded(cable.host, {"swarm-any": table_of(swarm, host)})
    ip(cable.host, "sysctl", "-qw", f"net.ipv4.tcp_syncookies={cookies}")
    for protocol in ("tcp", "udp"):
        ports = [number for kind, number in services(swarm, host.name) if kind == protocol and number != SSH]
        every = [str(port) for port in (*ports, ELSE)]
        with cable.listening(every, *as_account(account), program=(ANSWERS, protocol)):
            for namespace, source in ((cable.network, other), (cable.host, host.address)):
                argv = [sys.executable, "-c", ASKS, protocol, source, host.address, *every]
                answers = json.loads(ip(namespace, *argv))
                assert sorted(answers) == sorted([*ports, ELSE] if is_unit else [ELSE]), (protocol, source)


@pytest.mark.parametrize("account", [0, OTHER])
def test_other_accounts_call_from_ports_that_nodes_may_have(account: int, swarm: Swarm, cable: Cable) -> None:
    host, other = swarm.hosts["koala-laptop"], swarm.hosts["k3-pi"].address
    cable.address(host.address, [other])
    loaded(cable.host, {"swarm-any": table_of(swarm, host)})
    argv = [*as_account(account), sys.executable, "-c", ASKS, "tcp", host.address, other, str(ELSE)]
    with cable.listening([ELSE], program=(ANSWERS, "tcp"), where=cable.network):
        assert json.loads(ip(cable.host, *argv)) == [ELSE]


def as_account(number: int) -> tuple[str, ...]:
    return "setpriv", f"--reuid={number}", f"--regid={number}", "--clear-groups"


def test_an_address_of_wireguard_comes_out_of_it_alone(cable: Cable, tmp_path: Path) -> None:
    """A machine on the network has the address of a peer. ``eth0`` stands for it, then for WireGuard."""
    overlay = tmp_path / "overlay.yaml"
    overlay.write_text("security: sealed\n", "utf-8")
    swarm, _ = load_swarm(ROOT / "examples/paper-leader/swarm.yaml", overlay)
    assert swarm is not None
    host, peer = replace(swarm.hosts["koala-laptop"], user="nobody"), swarm.hosts["k3-pi"].ros_address
    table, wireguard = table_of(swarm, host), names.wireguard_interface(swarm.name)
    assert wireguard in table
    cable.address(host.ros_address, [])
    ip(cable.network, "ip", "address", "add", f"{peer}/16", "dev", "eth0")
    ip(cable.host, "ip", "route", "add", f"{peer}/32", "dev", "eth0")
    with cable.listening([MASTER]):
        for text, expected in ((table, []), (table.replace(wireguard, "eth0"), [(peer, MASTER)])):
            loaded(cable.host, {"swarm-any": text})
            assert opened(cable.network, [(peer, host.ros_address, MASTER)], len(expected)) == expected
