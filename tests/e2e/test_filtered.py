"""`security: filtered` in a lab: units exchange packets with declared hosts only; none restarts for it."""

from __future__ import annotations

import subprocess
from urllib.parse import urlsplit

import pytest

from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, namespace_of

CONNECT = "import socket, sys; socket.create_connection((sys.argv[1], int(sys.argv[2])), 2); print('open')"
LOOKUP = (
    "import os, xmlrpc.client; "
    "print(xmlrpc.client.ServerProxy(os.environ['ROS_MASTER_URI']).lookupNode('/test', '/k3/driver')[2])"
)


@pytest.fixture
def filtered(swarm: LabSwarm) -> LabSwarm:
    before = swarm.pids()
    run = swarm.deploy(swarm.variant("filtered", ("mode: leader", "security: filtered\nmode: leader")))
    assert run.status == 0, run.out + run.err
    assert swarm.pids() == before, "a list of addresses restarts nothing"
    return swarm


def foreign(swarm: LabSwarm, address: str, port: int) -> str:
    """What a machine that the spec does not declare gets from a port: it is on the wlan of the lab."""
    argv = ["nsenter", f"--net={namespace_of(swarm)}", "python3", "-c", CONNECT, address, str(port)]
    done = subprocess.run(argv, capture_output=True, text=True, check=False)
    return done.stdout.strip() or done.stderr.splitlines()[-1]


def test_a_foreign_machine_reaches_no_unit(filtered: LabSwarm) -> None:
    uri = urlsplit(filtered.shell("k3-pi", f'{SOURCE}; python3 -c "{LOOKUP}"').strip())
    assert uri.hostname == filtered.hosts["k3-pi"]
    assert uri.port
    assert foreign(filtered, filtered.hosts[LEADER], 22) == "open"
    assert foreign(filtered, filtered.hosts[LEADER], 11311) == "TimeoutError: timed out"
    assert foreign(filtered, uri.hostname, uri.port) == "TimeoutError: timed out"


def test_the_swarm_drives_and_is_healthy(filtered: LabSwarm) -> None:
    with filtered.driving(LEADER, "k3", 0.1):
        status = filtered.swarmctl("status", spec=filtered.deployed)
        assert status.status == 0, status.out
    filtered.seconds_to_standstill("k3")
