"""`security: filtered` in a lab: only declared hosts exchange packets, and each does what is its own."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from swarmctl.cli import exit_codes
from tests import ROOT
from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, lab_of, namespace_of, until
from tests.timing import wait_for

EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"
CONNECT = "import socket, sys; socket.create_connection((sys.argv[1], int(sys.argv[2])), 2); print('open')"
DROPPED = "TimeoutError: timed out"
CLOSED = "ConnectionRefusedError: [Errno 111] Connection refused"
LISTEN = (
    "import socket, time; one = socket.create_server((str(), 0)); "
    "print(one.getsockname()[1], flush=True); time.sleep(600)"
)
URI = "http://192.168.77.11:40000/"
CALL = (
    "import json, os, sys, xmlrpc.client; name, *given = sys.argv[1:]; "
    "print(json.dumps(getattr(xmlrpc.client.ServerProxy(os.environ['ROS_MASTER_URI']), name)(*given)))"
)
TAKE = """
import socket, sys, time
while True:
    try:
        kept = socket.create_server((sys.argv[1], 11311))
    except OSError:
        continue
    print("taken", flush=True)
    time.sleep(600)
"""
LOOKUP = (
    "import os, xmlrpc.client; "
    "print(xmlrpc.client.ServerProxy(os.environ['ROS_MASTER_URI']).lookupNode('/test', '/k3/driver')[2])"
)


@pytest.fixture(scope="module")
def lab(workplace: Path) -> Iterator[LabSwarm]:
    """In a folder of its own: that of a lab has the connections to its hosts, by their names."""
    folder = Path(tempfile.mkdtemp(prefix="fil-", dir=workplace))
    text = EXAMPLE.read_text("utf-8")
    spec = folder / "filtered.yaml"
    spec.write_text(f"{text}security: filtered\n", "utf-8")
    with lab_of(f"fil-{os.getpid()}", spec, folder) as swarm:
        run = swarm.deploy()
        assert run.status == 0, run.out + run.err
        yield swarm


@pytest.fixture
def filtered(lab: LabSwarm) -> LabSwarm:
    """The swarm of the first paper, filtered and healthy."""
    until(lambda: lab.swarmctl("status").status == exit_codes.OK, lambda: lab.swarmctl("status").out)
    return lab


def foreign(swarm: LabSwarm, address: str, port: int) -> str:
    """What a machine that the spec does not declare gets from a port: it is on the wlan of the lab."""
    argv = ["nsenter", f"--net={namespace_of(swarm)}", "python3", "-c", CONNECT, address, str(port)]
    done = subprocess.run(argv, capture_output=True, text=True, check=False)
    return done.stdout.strip() or done.stderr.splitlines()[-1]


@contextmanager
def program_listening(swarm: LabSwarm, host: str) -> Iterator[int]:
    """A program of a person, at any free port."""
    argv = f"nohup {shlex.join(['python3', '-c', LISTEN])} >/tmp/listens 2>/dev/null & echo $!"
    pid = swarm.shell(host, argv).strip()
    try:
        yield int(wait_for(lambda: swarm.shell(host, "cat /tmp/listens").strip()))
    finally:
        swarm.shell(host, f"kill {pid}; rm /tmp/listens")


def test_a_foreign_machine_reaches_no_unit(filtered: LabSwarm) -> None:
    uri = urlsplit(filtered.shell("k3-pi", f'{SOURCE}; python3 -c "{LOOKUP}"').strip())
    assert uri.hostname == filtered.hosts["k3-pi"]
    assert uri.port
    assert foreign(filtered, filtered.hosts[LEADER], 22) == "open"
    assert foreign(filtered, filtered.hosts[LEADER], 11311) == DROPPED
    assert foreign(filtered, uri.hostname, uri.port) == DROPPED


def test_a_foreign_machine_reaches_no_program_that_listens_as_a_node(filtered: LabSwarm) -> None:
    """Units of swarmctl have IP lists, other programs have none: the firewall is for all."""
    with program_listening(filtered, "k3-pi") as port:
        assert foreign(filtered, filtered.hosts["k3-pi"], port) == DROPPED
        argv = shlex.join(["python3", "-c", CONNECT, filtered.hosts["k3-pi"], str(port)])
        assert filtered.shell("epuck-pi", argv).strip() == "open"


def test_another_account_of_a_host_reaches_no_master(filtered: LabSwarm) -> None:
    for host, address in (("k3-pi", filtered.hosts[LEADER]), (LEADER, "127.0.0.1")):
        argv = shlex.join(["python3", "-c", CONNECT, address, "11311"])
        assert filtered.shell(host, argv).strip() == "open", "as the account of the host"
        answer = filtered.shell(host, f"sudo -u daemon {argv} 2>&1 || true").splitlines()[-1]
        assert answer == CLOSED


def test_another_account_of_a_host_reaches_no_driver(filtered: LabSwarm) -> None:
    uri = urlsplit(filtered.shell("k3-pi", f'{SOURCE}; python3 -c "{LOOKUP}"').strip())
    for address in (str(uri.hostname), "127.0.0.1"):
        argv = shlex.join(["python3", "-c", CONNECT, address, str(uri.port)])
        answer = filtered.shell("k3-pi", f"sudo -u daemon {argv} 2>&1 || true").splitlines()[-1]
        assert answer == CLOSED


def test_a_host_of_the_swarm_does_nothing_that_is_for_another(filtered: LabSwarm) -> None:
    calls = (
        ("registerPublisher", "/epuck/driver", "/epuck/odom", "nav_msgs/Odometry", URI),
        ("registerPublisher", "/mine", "/epuck/cmd_vel", "geometry_msgs/Twist", URI),
        ("setParam", "/mine", "/epuck/driver/wheel_radius", 9.9),
        ("setParam", "/mine", "/run_id", "mine"),
        ("shutdown", "/mine"),
    )
    for call in calls:
        argv = shlex.join(["python3", "-c", CALL, *map(str, call)])
        code, reason, _ = json.loads(filtered.shell("k3-pi", f"{SOURCE}; {argv}"))
        assert code == -1, call
        assert reason.startswith("refused by the guard of the master: "), call
    journal = filtered.shell(LEADER, "sudo journalctl -u swarm-newswarm.master -o cat")
    assert "refused: shutdown /mine from 192.168.77.11 (k3-pi): no call for others" in journal


def test_no_other_account_gets_the_port_of_the_master(filtered: LabSwarm) -> None:
    """It waits for the moment when nobody has the port: the master's unit restarts, and crashes."""
    unit = "swarm-newswarm.master"
    taking = shlex.join(["sudo", "-u", "daemon", "python3", "-c", TAKE, filtered.hosts[LEADER]])
    filtered.shell(LEADER, f"nohup {taking} >/tmp/taken 2>&1 & sleep 0.5; pgrep -u daemon python3")
    try:
        for command in (f"restart {unit}", f"kill --signal=KILL {unit}"):
            before = filtered.units(LEADER)["master"].pid
            filtered.shell(LEADER, f"sudo systemctl {command}", timeout=60)
            wait_for(lambda before=before: filtered.units(LEADER)["master"].pid not in (0, before))
            until(lambda: filtered.swarmctl("status").status == exit_codes.OK, "it is not healthy again")
        assert filtered.shell(LEADER, "cat /tmp/taken") == ""
    finally:
        filtered.shell(LEADER, "sudo pkill -KILL -u daemon python3; true")


def test_a_host_that_boots_has_its_firewall_before_other_programs(filtered: LabSwarm) -> None:
    """Services, and programs of people, start after basic.target (bootup(7))."""
    filtered.reboot("k3-pi")

    def entered(unit: str) -> int:
        show = f"systemctl show --value --property=ActiveEnterTimestampMonotonic {unit}"
        return int(filtered.shell("k3-pi", show))

    assert 0 < entered("swarm-newswarm.firewall") < entered("basic.target")


def test_a_flushed_firewall_is_unhealthy_until_its_unit_restarts(filtered: LabSwarm) -> None:
    filtered.shell("k3-pi", "sudo nft flush ruleset")
    status = filtered.swarmctl("status")
    assert status.status == exit_codes.UNHEALTHY
    assert "firewall k3-pi: table swarm-newswarm of nftables is not loaded" in status.out
    filtered.shell("k3-pi", "sudo systemctl restart swarm-newswarm.firewall")
    assert filtered.swarmctl("status").status == 0


def test_the_swarm_drives_and_is_healthy(filtered: LabSwarm) -> None:
    with filtered.driving(LEADER, "k3", 0.1):
        status = filtered.swarmctl("status")
        assert status.status == 0, status.out
    filtered.seconds_to_standstill("k3")
