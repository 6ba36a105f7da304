"""Drivers and masters that nobody has stopped run again; launch files start no second node of a name."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from swarmctl.cli import exit_codes
from tests.child_process import child_process
from tests.e2e.lab_swarm import HOME, LEADER, SOURCE, LabSwarm, SshError, moves, quoted, until
from tests.e2e.node_ends import BACK, OF_STRANGERS, answers, ends_and_is_back, tries
from tests.timing import Promise

MASTER, K3 = "swarm-newswarm.master.service", "swarm-newswarm.k3.service"
PORT_FREE = 25.0  # s from then on until all nodes are registered again
#: A master that takes the port as soon as it is free.
FOREIGN = """
import socket, time
import rosmaster.master
while True:
    try:
        with socket.socket() as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            one.bind(("", 11311))
            one.listen(1)
        break
    except OSError:
        time.sleep(0.005)
rosmaster.master.Master(11311).start()
time.sleep(300)
"""
#: Holds more connections to each server of a driver than its process may have files.
CROWD = """
import resource, rosgraph, socket, time, xmlrpc.client
from urllib.parse import urlsplit
_, most = resource.getrlimit(resource.RLIMIT_NOFILE)
resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
uri = rosgraph.Master("/stranger").lookupNode("/k3/driver")
_, host, port = xmlrpc.client.ServerProxy(uri).requestTopic("/stranger", "/k3/odom", [["TCPROS"]])[2]
held = [socket.create_connection(place)
        for place in ((host, port), (host, urlsplit(uri).port)) for _ in range(1300)]
print("held", flush=True)
time.sleep(300)
"""


def test_a_driver_that_nobody_has_stopped_runs_again(swarm: LabSwarm, promise: Promise) -> None:
    took = ends_and_is_back(swarm, "k3-pi", "k3", "/k3/driver", "a clean exit")
    promise("driver answers again after a clean exit", took, BACK)
    with swarm.driving(LEADER, "k3", 0.1):
        pass
    until(lambda: swarm.swarmctl("status").status == 0, "the swarm does not get well")


def test_no_stranger_ends_a_driver(swarm: LabSwarm) -> None:
    """It drives on as the same process, takes its name back, and status names who took it."""
    before = swarm.units("k3-pi")["k3"]
    with swarm.driving(LEADER, "k3", 0.1):
        for way in OF_STRANGERS:
            unit = tries(swarm, LEADER, "k3", "/k3/driver", way)
            until(lambda: answers(swarm, "k3-pi", "/k3/driver"), f"it does not answer after {way}")
            assert moves(swarm.robot("k3"))
    assert swarm.units("k3-pi")["k3"] == before
    seen = swarm.swarmctl("status")
    assert f"a second node called /k3/driver has taken the name from that of {unit} on k3-pi" in seen.out
    with swarm.driving(LEADER, "k3", 0.1):
        pass
    swarm.shell("k3-pi", f"sudo systemctl restart {unit}")  # what status counts begins anew
    until(lambda: swarm.swarmctl("status").status == 0, "the swarm does not get well")


def test_a_crowd_of_connections_ends_no_driver(swarm: LabSwarm) -> None:
    """Its watchdog is served, another host subscribes, and the robot stands when its commands end."""
    before = swarm.units("k3-pi")["k3"]
    argv = swarm.shell_argv("epuck-pi", f"{SOURCE}; exec python3 -c {quoted(CROWD)}")
    with child_process(argv, stdout=subprocess.PIPE) as crowd:
        assert crowd.stdout is not None
        assert crowd.stdout.readline() == "held\n"
        with swarm.driving(LEADER, "k3", 0.1):
            swarm.odometry(LEADER, "k3")
        swarm.seconds_to_standstill("k3")
        crowd.kill()
    assert swarm.units("k3-pi")["k3"] == before


@contextmanager
def foreign_master(swarm: LabSwarm) -> Iterator[None]:
    """Another master has the port of the swarm's own, which was killed."""
    script = f"exec python3 -c {quoted(FOREIGN)} >/dev/null 2>&1 & echo $!"
    pid = swarm.shell(LEADER, f"{SOURCE}; {script}").strip()
    try:
        swarm.shell(LEADER, f"sleep 1; sudo systemctl kill -s KILL {MASTER}")
        yield
    finally:
        swarm.shell(LEADER, f"kill -9 {pid}")


@pytest.mark.slow
def test_a_master_waits_for_its_port_and_comes_back(swarm: LabSwarm, promise: Promise) -> None:
    def cause() -> str:
        run = swarm.swarmctl("status", "--json", "--window", "0.5")
        assert run.status == exit_codes.UNHEALTHY, run.out
        findings = {one["key"]: one for one in run.json()["findings"]}
        assert findings[f"master {LEADER}"]["state"] == "bad", "the foreign master is taken for the own"
        return str(findings[f"unit {MASTER} on {LEADER}"]["message"])

    with foreign_master(swarm):
        until(lambda: swarm.units(LEADER)["master"].active == "activating", "the master does not wait")
        until(lambda: "port 11311 is in use by process" in cause(), "nobody names who has the port")
        often = "crash loop: restarted [0-9]+ times|ended and is started again"
        assert re.match(f"({often}), last result", cause()), cause()
    took = until(lambda: answers(swarm, LEADER, "/k3/driver"), "the nodes are not registered")
    promise("nodes answer again after a foreign master has gone", took, PORT_FREE)
    until(lambda: swarm.swarmctl("status").status == 0, "the swarm does not get well")
    assert swarm.units(LEADER)["master"].active == "active"
    swarm.everywhere("sudo systemctl reset-failed 'swarm-newswarm.*.service'")


def test_roslaunch_refuses_while_the_unit_runs(swarm: LabSwarm) -> None:
    before = swarm.units("k3-pi")["k3"]
    for name in ("k3", "swarm"):
        with pytest.raises(SshError) as refused:
            swarm.shell("k3-pi", f"{SOURCE}; timeout 20 roslaunch {HOME}/current/launch/{name}.launch")
        assert f"as {K3}; to start them by hand, first: sudo systemctl stop {K3}" in str(refused.value)
    assert swarm.units("k3-pi")["k3"] == before
