"""``swarmctl topic`` on lab hosts of ROS 2 without a `ros2` command: with discovery servers, filtered."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import SWARM, LabSwarm, lab_of, quoted, until
from tests.e2e.test_topic import PUB, running

DESK, PI = "desk", "k3-pi"
SPEC = f"""\
version: 1
name: {SWARM}
mode: leader
leader: {DESK}
security: filtered
ros: {{distro: jazzy, servers: [{DESK}, {PI}]}}
hosts:
  {DESK}: {{address: 192.168.77.10, user: robot}}
  {PI}: {{address: 192.168.77.11, user: robot}}
robots:
  k3: {{type: khepera3, host: {PI}}}
links:
  - {{kind: wlan, name: air, hosts: [{DESK}, {PI}]}}
  - {{kind: serial, host: {PI}, robot: k3, usb: {{serial: FTDI1234}}}}
programs:
  joystick: {{host: {DESK}, use: teleop-joy, params: {{device: /dev/input/js0}}}}
control:
  - {{by: joystick, of: [k3]}}
"""
NEWS = ("/news", "std_msgs/String", "{data: it's 5}", "--once")
#: Prints the first message.
READER = """\
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("reader")
def take(message):
    print(message.data)
    raise SystemExit
node.create_subscription(String, "/news", take, 1)
rclpy.spin(node)
"""


@pytest.fixture(scope="module")
def swarm(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "topics.yaml"
    spec.write_text(SPEC)
    skip_without_wheels(spec)
    with lab_of(f"topics-{os.getpid()}", spec, workplace) as found:
        run = found.deploy()
        assert run.status == 0, run.out + run.err
        yield found


@pytest.fixture(autouse=True)
def _gone(swarm: LabSwarm) -> Iterator[None]:
    """No program is left on a host."""
    yield
    until(lambda: not "".join(swarm.everywhere("pgrep -f '[r]os2_tools' || true").values()), "it goes on")


def test_the_list_has_types_and_counts_of_all_hosts(swarm: LabSwarm) -> None:
    done = swarm.swarmctl("topic list", "--json")
    assert done.status == 0, done.err
    topics = {one["topic"]: one["islands"] for one in done.json()["topics"]}
    (odom,), (commands,) = topics["/k3/odom"], topics["/k3/cmd_vel"]
    assert (odom["type"], odom["publishers"], odom["subscribers"]) == ("nav_msgs/msg/Odometry", 1, 0)
    assert (commands["publishers"], commands["subscribers"]) == (1, 1)


def test_echo_prints_messages_and_hz_their_rate(swarm: LabSwarm) -> None:
    done = swarm.swarmctl("topic echo", "/k3/odom", "-n", "3")
    assert done.status == 0, done.err
    assert len(re.findall(r"^child_frame_id: k3/base_", done.out, re.M)) == 3
    assert done.out.endswith("\n---\n")
    with running(swarm, "hz", "/k3/odom") as process:
        assert process.stdout is not None
        line = next(one for one in process.stdout if "average rate" in one)
    assert float(re.findall(r"[\d.]+", line)[0]) == pytest.approx(10, rel=0.5)


def test_a_node_of_another_host_receives_what_is_published_once(swarm: LabSwarm) -> None:
    done = swarm.swarmctl("topic pub", *NEWS)
    assert done.status == exit_codes.ERROR
    assert done.err == "error: nothing was published: nobody subscribes to /news as std_msgs/msg/String\n"
    with swarm.running(PI, f"python3 -uc {quoted(READER)}") as reader:
        done = swarm.swarmctl("topic pub", *NEWS)
        assert (done.status, done.out, done.err) == (0, "", "")
        assert reader.process.stdout is not None
        assert reader.process.stdout.readline() == "it's 5\n"


def test_a_robot_refuses_it_and_names_it(swarm: LabSwarm) -> None:
    place = swarm.robot("k3")["distance"]
    with running(swarm, "pub", *PUB) as process:
        until(lambda: "refuses /_swarm_topic_" in swarm.diagnosis(DESK, "k3"), "no refusal")
    assert process.stderr is not None
    assert "k3 will ignore this" in process.stderr.read()
    assert swarm.robot("k3")["distance"] == place
