"""`security: sealed` in a lab: ROS uses WireGuard, and the key of a host proves who sends."""

from __future__ import annotations

import os
import shlex
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from swarm_onboard.tunnel.keys import Keys

from swarmctl.cli import exit_codes
from swarmctl.lab.hosts import network
from swarmctl.lab.paths import lab_paths
from tests import ROOT
from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, lab_of, moves, until
from tests.e2e.ros_addresses import ros_addresses
from tests.e2e.test_filtered import CONNECT, LOOKUP, foreign

EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"
pytestmark = pytest.mark.skipif(not Path("/dev/net/tun").exists(), reason="needs /dev/net/tun")
UNIT = "swarm-newswarm.wireguard"
KEY = "/etc/swarm/newswarm/wireguard.key"


@pytest.fixture(scope="module")
def lab(workplace: Path) -> Iterator[LabSwarm]:
    """In a folder of its own: that of a lab has the connections to its hosts, by their names."""
    folder = Path(tempfile.mkdtemp(prefix="sea-", dir=workplace))
    text = EXAMPLE.read_text("utf-8")
    spec = folder / "sealed.yaml"
    spec.write_text(f"{text}security: sealed\n", "utf-8")
    with lab_of(f"sea-{os.getpid()}", spec, folder) as swarm:
        refused = swarm.deploy()
        assert refused.status != 0
        assert (
            "the WireGuard keys of koala-laptop, epuck-pi, k3-pi are not pinned" in refused.out + refused.err
        )
        pinned = swarm.swarmctl("trust")
        assert pinned.status == 0, pinned.out + pinned.err
        run = swarm.deploy()
        assert run.status == 0, run.out + run.err
        yield swarm


@pytest.fixture
def sealed(lab: LabSwarm) -> LabSwarm:
    """The swarm of the first paper, sealed and healthy."""
    until(lambda: lab.swarmctl("status").status == exit_codes.OK, lambda: lab.swarmctl("status").out)
    return lab


def keys_of(swarm: LabSwarm) -> Keys:
    return Keys(lab_paths(swarm.name).wireguard_keys.read_text("utf-8"))


def reaches(swarm: LabSwarm, host: str, other: str) -> bool:
    """Whether a node on ``other``, whose host gives its port, accepts a connection from ``host``."""
    find = "ss -Hltn | awk '{print $4}' | grep -o '[0-9]*$' | sort -n | tail -1"
    port = swarm.shell(other, find).strip()
    argv = shlex.join(["python3", "-c", CONNECT, ros_addresses(swarm)[other], port])
    return swarm.shell(host, f"{argv} 2>/dev/null || true").strip() == "open"


def ip(swarm: LabSwarm, host: str | None, command: str) -> None:
    namespace = network.namespace_path(lab_paths(swarm.name), host)
    subprocess.run(["ip", "-n", namespace.name, *command.split()], check=True, capture_output=True)


@contextmanager
def address_taken(swarm: LabSwarm, host: str) -> Iterator[None]:
    """``host`` is cut off, and a machine on the wlan has both its addresses, and routes to those of ROS."""
    own = [f"{swarm.hosts[host]}/24", f"{ros_addresses(swarm)[host]}/16"]
    swarm.cut(host)
    try:
        for one in own:
            ip(swarm, None, f"address add {one} dev br0")
        for one in (None, *swarm.hosts):
            ip(swarm, one, "neighbour flush all")
        yield
    finally:
        for one in own:
            ip(swarm, None, f"address delete {one} dev br0")
        swarm.join(host)
        for one in (None, *swarm.hosts):
            ip(swarm, one, "neighbour flush all")


def test_nodes_are_in_wireguard_and_ssh_is_not(sealed: LabSwarm) -> None:
    uri = urlsplit(sealed.shell("k3-pi", f'{SOURCE}; python3 -c "{LOOKUP}"').strip())
    assert uri.hostname == ros_addresses(sealed)["k3-pi"]
    assert uri.port is not None
    assert foreign(sealed, sealed.hosts[LEADER], 22) == "open"
    for host, port in ((LEADER, 11311), ("k3-pi", uri.port)):
        assert foreign(sealed, sealed.hosts[host], port) != "open"
        argv = shlex.join(["python3", "-c", CONNECT, ros_addresses(sealed)[host], str(port)])
        assert sealed.shell("epuck-pi", argv).strip() == "open"


@pytest.mark.parametrize(("taken", "to"), [("epuck-pi", LEADER), (LEADER, "k3-pi")])
def test_who_takes_the_addresses_of_a_host_reaches_no_node(sealed: LabSwarm, taken: str, to: str) -> None:
    """Of a robot's host, and of the master's and commander's."""
    uri = urlsplit(sealed.shell("k3-pi", f'{SOURCE}; python3 -c "{LOOKUP}"').strip())
    port = uri.port if to == "k3-pi" else 11311
    assert port is not None
    with address_taken(sealed, taken):
        for address in (sealed.hosts[to], ros_addresses(sealed)[to]):
            assert foreign(sealed, address, port) != "open"
        assert foreign(sealed, sealed.hosts[to], 22) == "open", "the address itself works"


def test_a_private_key_is_for_root_of_its_host_alone(sealed: LabSwarm) -> None:
    public = keys_of(sealed).live
    assert set(public) == set(sealed.hosts)
    for host, (key,) in public.items():
        assert sealed.shell(host, f"sudo cat {KEY} | wg pubkey").strip() == key
        assert sealed.shell(host, f"sudo stat -c '%a %U' {KEY}").strip() == "600 root"
        assert sealed.shell(host, f"sudo grep -rlsF -f {KEY} /opt/swarm /var/log /run || true") == ""
        private = sealed.shell(host, f"sudo cat {KEY}").strip().encode()
        files = [one for one in sealed.folder.rglob("*") if one.is_file()]
        assert not [one for one in files if private in one.read_bytes()], "on the operator's side"


def test_a_host_without_wireguard_is_unhealthy(sealed: LabSwarm) -> None:
    sealed.shell("k3-pi", f"sudo systemctl stop {UNIT}")
    status = sealed.swarmctl("status")
    assert status.status == exit_codes.UNHEALTHY
    sealed.shell("k3-pi", f"sudo systemctl start {UNIT}")


@pytest.mark.parametrize("step", [-1000, 1000])
def test_a_clock_that_was_set_is_the_cause_of_what_it_makes_old(sealed: LabSwarm, step: int) -> None:
    """The handshakes of the lab stay, as does its clock; ages on the host are wrong."""
    lab = ("--name", sealed.name)
    assert (
        sealed.run("lab", "fault", "clock", str(sealed.spec), "k3-pi", "--step", str(step), *lab).status == 0
    )
    try:
        found = sealed.findings()
    finally:
        assert sealed.run("lab", "repair", str(sealed.spec), "k3-pi", *lab).status == 0
    assert found["wireguard k3-pi koala-laptop"]["cause"] == "clock k3-pi"
    assert {one["cause"] or key for key, one in found.items()} == {"clock k3-pi"}


def test_the_swarm_drives_and_stands_with_new_keys(sealed: LabSwarm) -> None:
    before = keys_of(sealed)
    with sealed.driving(LEADER, "k3", 0.1):
        assert sealed.swarmctl("status").status == 0
        run = sealed.swarmctl("rekey")
        assert run.status == 0, run.out + run.err
        after = keys_of(sealed)
        assert after.retired == before.live
        assert not {*after.live.values()} & {*before.live.values()}
        until(lambda: moves(sealed.robot("k3")), "no command arrives with the new keys")
        assert sealed.plan().out.startswith("nothing to do")
    sealed.seconds_to_standstill("k3")


def test_a_lost_host_is_accepted_nowhere(sealed: LabSwarm) -> None:
    """Nor on one that was away, once a deploy reaches it. Set up anew, the lost one may come back."""
    lost, away = "epuck-pi", "k3-pi"
    assert reaches(sealed, lost, LEADER)
    sealed.cut(away)
    run = sealed.swarmctl("expel", lost, "--yes")
    assert run.status == exit_codes.HOSTS_UNREACHABLE, run.out + run.err
    assert run.out.endswith(f"not accepted any more by {LEADER}\n")
    assert f"it accepts {lost} until the next deploy" in run.err
    assert not reaches(sealed, lost, LEADER)
    sealed.join(away)
    until(lambda: reaches(sealed, lost, away), "the host that was away is not reached")
    status = sealed.swarmctl("status")
    assert status.status == exit_codes.UNHEALTHY
    assert f"its WireGuard accepts {lost}, which was expelled" in status.out
    assert sealed.deploy().status == exit_codes.OK
    until(lambda: not reaches(sealed, lost, away), "the deploy does not finish it")
    until(lambda: sealed.swarmctl("status").status == exit_codes.OK, lambda: sealed.swarmctl("status").out)

    assert "was expelled from the swarm" in str(sealed.swarmctl("exec", lost, "true"))
    sealed.shell(lost, f"sudo rm {KEY}")
    assert sealed.swarmctl("trust").status == exit_codes.OK
    assert lost not in keys_of(sealed).live
    assert sealed.swarmctl("trust", "--host", lost, "--replace").status == exit_codes.OK
    assert sealed.deploy().status == exit_codes.OK
    until(lambda: reaches(sealed, lost, away), "it does not come back")
