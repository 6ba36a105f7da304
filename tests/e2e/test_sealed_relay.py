"""A sealed swarm in two networks: the leader's laptop, which is in both, relays from one to the other."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from swarm_onboard.tunnel.keys import Keys

from swarmctl.cli import exit_codes
from swarmctl.lab.paths import lab_paths
from tests import ROOT
from tests.child_process import child_process
from tests.e2e import test_sealed
from tests.e2e.lab_swarm import SOURCE, LabSwarm, lab_of, namespace_of, until

pytestmark = test_sealed.pytestmark
SPEC = ROOT / "tests/e2e/two-networks.yaml"
RECEIVES = """
import socket
one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
one.bind(("", 7000))
one.settimeout(3)
print("ready", flush=True)
try:
    print(one.recv(100), flush=True)
except socket.timeout:
    print("nothing", flush=True)
"""
SENDS = """
import socket, sys
one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
for _ in range(10):
    one.sendto(b"out", (sys.argv[1], 7000))
"""
ECHO = f"{SOURCE}; timeout 20 rostopic echo -n 1 /epuck/odom/header/frame_id"


@pytest.fixture(scope="module")
def lab(workplace: Path) -> Iterator[LabSwarm]:
    folder = Path(tempfile.mkdtemp(prefix="rel-", dir=workplace))
    spec = folder / "relay.yaml"
    spec.write_text(SPEC.read_text("utf-8"), "utf-8")
    with lab_of(f"rel-{os.getpid()}", spec, folder) as swarm:
        for verb in ("trust", "deploy"):
            run = swarm.swarmctl(verb, *(["--yes"] if verb == "deploy" else []))
            assert run.status == exit_codes.OK, run.out + run.err
        yield swarm


def test_hosts_of_two_networks_have_one_graph(lab: LabSwarm) -> None:
    until(lambda: lab.swarmctl("status").status == exit_codes.OK, lambda: lab.swarmctl("status").out)
    assert "epuck/odom" in lab.shell("k3-pi", ECHO)
    with lab.driving("laptop", "epuck", 0.1):
        assert lab.swarmctl("rekey").status == exit_codes.OK
        until(lambda: "epuck/odom" in lab.shell("k3-pi", f"{ECHO} || true"), "nothing passes with new keys")


def test_packets_of_a_peer_leave_for_no_other_network(lab: LabSwarm) -> None:
    """Not even if root on its host wants to: what comes out of WireGuard on the relay goes back into it."""
    here = ["nsenter", f"--net={namespace_of(lab)}"]  # a machine on the leader's network
    show = [*here, "ip", "-o", "-4", "address", "show", "to", "192.168.77.0/24"]
    shown = subprocess.check_output(show, text=True)
    address = shown.split()[3].partition("/")[0]
    relay = Keys(lab_paths(lab.name).wireguard_keys.read_text("utf-8")).live["laptop"][0]
    own = lab.shell("epuck-pi", "sudo wg show wg-newswarm allowed-ips").split("\t")[1]
    wider = ",".join([*own.split(), f"{address}/32"])
    lab.shell("epuck-pi", f"sudo wg set wg-newswarm peer {relay} allowed-ips {wider}")
    lab.shell("epuck-pi", f"sudo ip route replace {address}/32 dev wg-newswarm")
    listen = [*here, sys.executable, "-c", RECEIVES]
    with child_process(listen, stdout=subprocess.PIPE) as listener:
        assert listener.stdout is not None
        assert listener.stdout.readline() == "ready\n"
        lab.shell("epuck-pi", shlex.join(["python3", "-c", SENDS, address]))
        assert listener.stdout.read() == "nothing\n"
