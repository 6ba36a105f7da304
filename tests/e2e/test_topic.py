"""``swarmctl topic`` on the hosts of a lab of ROS 1, with `rostopic`."""

from __future__ import annotations

import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.e2e.lab_swarm import LEADER, LabSwarm, moves, until
from tests.timing import PATIENCE

STRANGER = "epuck-pi"
PUB = ("/k3/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.1}}", "--rate", "10")
ABLE = ("env", "--default-signal=INT")  # workers of pytest ignore Ctrl-C


@contextmanager
def running(swarm: LabSwarm, verb: str, *words: str) -> Iterator[subprocess.Popen[str]]:
    """The verb under way, ended by Ctrl-C."""
    process = swarm.begin(f"topic {verb}", *words, through=ABLE)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
        assert process.stdout is not None
        process.stdout.close()


def ended(swarm: LabSwarm, host: str) -> None:
    pids = "pgrep -f '[r]ostopic' || true"
    until(lambda: not swarm.shell(host, pids).strip(), f"rostopic goes on on {host}")


def test_the_list_has_the_topics_of_robots(swarm: LabSwarm) -> None:
    done = swarm.swarmctl("topic list", "--json")
    assert done.status == 0, done.err
    topics = {one["topic"]: one["islands"] for one in done.json()["topics"]}
    (odom,) = topics["/k3/odom"]
    assert (odom["type"], odom["publishers"]) == ("nav_msgs/Odometry", 1)


def test_echo_prints_one_pose_and_hz_its_rate(swarm: LabSwarm) -> None:
    done = swarm.swarmctl("topic echo", "/k3/odom", "-n", "1")
    assert done.status == 0, done.err
    assert "    position: \n      x: " in done.out
    assert done.out.endswith("\n---\n")
    with running(swarm, "hz", "/k3/odom") as process:
        assert process.stdout is not None
        line = next(one for one in process.stdout if "average rate" in one)
    assert float(re.findall(r"[\d.]+", line)[0]) == pytest.approx(10, rel=0.2)
    ended(swarm, LEADER)


def test_a_robot_obeys_pub_on_its_leader_alone(swarm: LabSwarm) -> None:
    place = swarm.robot("k3")["distance"]
    with running(swarm, "pub", *PUB, "--host", STRANGER) as process:
        until(lambda: "refuses /rostopic" in swarm.diagnosis(LEADER, "k3"), "no refusal")
    assert process.stderr is not None
    assert "k3 will ignore this" in process.stderr.read()
    assert swarm.robot("k3")["distance"] == place
    with running(swarm, "pub", *PUB):
        until(lambda: moves(swarm.robot("k3")), "k3 does not move")
    swarm.seconds_to_standstill("k3")
    ended(swarm, LEADER)
