"""SROS 2 in the lab: nodes without a key are out, and a key allows no more than the graph does."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.experiment import EXAMPLES, Experiment, seconds_to_health
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, lab_of, quoted
from tests.loading import load_swarm

GIVEN = (
    "SWARMCTL_SECURE_ROS2"  # a folder with libraries of Fast DDS and its rmw for Jazzy, with -DSECURITY=ON
)
SPEC = EXAMPLES / "ros2-2-leader/swarm.yaml"
NO_KEYS = ". /opt/ros/jazzy/setup.sh; export ROS_DOMAIN_ID={domain} ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
NOTES = """  notes:
    host: k3-pi
    command: [python3, -c, "{code}"]
    publishes: [{{topic: /notes, type: std_msgs/String}}]
"""
CODE = (
    "import rclpy, std_msgs.msg; rclpy.init(); node = rclpy.create_node('notes'); "
    "notes = node.create_publisher(std_msgs.msg.String, '/notes', 1); rclpy.spin(node)"
)
SEEN = """
import rclpy, time
rclpy.init()
node = rclpy.create_node("looks")
time.sleep(3)
print([name for name, _ in node.get_topic_names_and_types()])
"""


def secured(swarm: LabSwarm) -> None:
    """Signs the lab's spec, in which the gamepad is a person's, and a host runs a program of its own."""
    text = swarm.spec.read_text("utf-8")
    begin, end = text.index("  gamepad:"), text.index("  joystick:")
    text = (text[:begin] + NOTES.format(code=CODE) + text[end:]).replace(
        "{distro: jazzy}", "{distro: jazzy, sros2: true}"
    )
    swarm.spec.write_text(text.replace("name: newswarm", "name: newswarm\nsecurity: filtered"), "utf-8")
    keys = swarm.run("keys", str(swarm.spec))
    assert keys.status == exit_codes.OK, keys.err


@pytest.fixture(scope="module")
def experiment(workplace: Path) -> Iterator[Experiment]:
    """The second experiment, on hosts whose Fast DDS has security."""
    skip_without_wheels(SPEC)
    if not (given := os.environ.get(GIVEN)):
        pytest.skip(
            f"the wheels of ROS 2 are built without security: set {GIVEN} to a folder with such libraries"
        )
    folder = workplace / "sros2"
    folder.mkdir()
    with lab_of(f"sros2-{os.getpid()}", SPEC, folder) as swarm:
        for host in swarm.hosts:
            put = swarm.shell_argv(host, "sudo tar -xC /opt/ros/jazzy/lib --no-same-owner")
            packed = subprocess.run(["tar", "-cC", given, "."], check=True, capture_output=True, timeout=30)
            subprocess.run(put, input=packed.stdout, check=True, timeout=30)
        secured(swarm)
        deploy = swarm.timed_deploy()
        assert deploy.status == exit_codes.OK, deploy.out + deploy.err
        healthy = seconds_to_health(swarm)
        spec, _ = load_swarm(swarm.spec)
        assert spec is not None
        yield Experiment(swarm, spec, {"deployed": deploy.seconds, "then healthy": healthy})


def test_the_graph_has_just_what_the_spec_says(experiment: Experiment) -> None:
    """As a person with the keys of people sees it."""
    experiment.settles()
    assert experiment.lab.plan().status == exit_codes.OK


def test_the_gamepad_drives_the_robots(experiment: Experiment) -> None:
    with experiment.gamepad() as pad:
        experiment.drives(pad, "koala", "k3", "epuck")
        pad.let_go()
        experiment.seconds_to_rest()


def test_a_node_without_a_key_sees_nothing_and_moves_nothing(experiment: Experiment) -> None:
    """As the account of the host, whose packets the firewall lets pass."""
    no_keys = NO_KEYS.format(domain=experiment.spec.islands[0].discovery.domain)
    seen = experiment.lab.shell("k3-pi", f"{no_keys}; python3 -c {quoted(SEEN)}")
    assert "/parameter_events" in seen
    assert "/k3" not in seen
    with experiment.lab.publishing("k3-pi", "k3", 0.1, source=no_keys):
        experiment.stands("k3", 4.0)
        assert experiment.lab.ros.stranger not in experiment.lab.diagnosis("k3-pi", "k3")


@pytest.mark.parametrize(("enclave", "robot"), [("hosts/k3-pi", "epuck"), ("robots/k3", "koala")])
def test_no_key_lets_its_owner_publish_commands_of_other_robots(
    experiment: Experiment, enclave: str, robot: str
) -> None:
    """Neither a person nor root on another robot's host, who has its driver's key."""
    unit = "enclaves" if enclave.startswith("hosts") else "k3"
    keys = f"export ROS_SECURITY_KEYSTORE=/run/swarm-newswarm.{unit} ROS_SECURITY_ENCLAVE_OVERRIDE=/{enclave}"
    publish = experiment.lab.ros.publish(f"/{robot}/cmd_vel", 0.1, 0.0, 10)
    command = f"{SOURCE}; {keys}; timeout 10 {publish} 2>&1 || true"
    printed = experiment.lab.shell("k3-pi", f"sudo bash -c {quoted(command)}")
    assert f"rt/{robot}/cmd_vel topic denied by deny rule" in printed
    experiment.stands(robot)


def test_a_host_whose_ros_has_no_security_is_as_before(workplace: Path) -> None:
    """No node of it joins with its keys ignored: the deploy is undone, and its cause named."""
    skip_without_wheels(SPEC)
    folder = workplace / "unsecured"
    folder.mkdir()
    with lab_of(f"unsecured-{os.getpid()}", SPEC, folder) as swarm:
        secured(swarm)
        deploy = swarm.swarmctl("deploy", "--yes", "--limit", LEADER)
        assert deploy.status == exit_codes.HOSTS_FAILED
        assert "This Fast DDS version doesn't have the security libraries" in deploy.out + deploy.err
        assert "undone, the host is as before" in deploy.out
        assert swarm.units(LEADER) == {}
