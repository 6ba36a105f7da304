"""`status` of a swarm of ROS 2: two hosts with real rclpy, whose nodes find each other over a server."""

from __future__ import annotations

import base64
import io
import json
import os
import shlex
import tarfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import pytest

from swarmctl.health.collect import probe_hosts
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, Release, expected_graph
from swarmctl.health.root_cause import Diagnosis
from swarmctl.health.verdict import State
from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import image, ros_wheels
from swarmctl.lab.lab_plan import plan_of
from swarmctl.remote.transport import Session, Target
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests.lab.lab_values import with_distro
from tests.lab.tiny_labs import booted, in_a_lab, on, quiet
from tests.loading import load_swarm
from tests.onboard.agent.local_session import LocalSession
from tests.timing import wait_for

SPEC = """\
version: 1
name: tiny
mode: central
hub: alpha
ros: {distro: kilted, discovery: server}
hosts:
  alpha: {address: 10.91.1.1, user: root}
  beta: {address: 10.91.1.2, user: root}
robots:
  koala: {type: koala, host: alpha}
  k3: {type: khepera3, host: beta}
links:
  - {kind: wlan, name: air, hosts: [alpha, beta], multicast: false}
  - {kind: serial, host: alpha, robot: koala, usb: {serial: KOALA1}}
  - {kind: serial, host: beta, robot: k3, usb: {serial: FTDI1234}}
"""
#: What a node with these topics does, at the rate that status expects.
NODE = """
import importlib, json, sys
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
wanted = json.loads(sys.argv[1])
def kind(name):
    package, _, one = name.split("/")
    return getattr(importlib.import_module(package + ".msg"), one)
def quality(one):
    return QoSProfile(depth=5, reliability=ReliabilityPolicy[one.get("reliability", "RELIABLE")])
rclpy.init()
space, name = wanted["name"].rsplit("/", 1)
node = rclpy.create_node(name, namespace=space)
for one in wanted["publishes"]:
    message = kind(one["type"])()
    if one["topic"] == "/diagnostics":
        from diagnostic_msgs.msg import DiagnosticStatus
        message.status = [DiagnosticStatus(name=wanted["name"], message="drives " + wanted["name"])]
    publisher = node.create_publisher(type(message), one["topic"], quality(one))
    node.create_timer(1 / one["rate"], lambda to=publisher, message=message: to.publish(message))
for one in wanted.get("subscribes", ()):
    node.create_subscription(kind(one["type"]), one["topic"], lambda _: None, quality(one))
rclpy.spin(node)
"""
#: The checks that look at the graph; no host of this lab has a whole release, or a robot.
OF_THE_GRAPH = (
    "authority", "command type", "discovery", "driver", "environment", "node name", "probe", "publisher",
    "qos", "report", "topic", "type",
)  # fmt: skip
CURRENT = "/opt/swarm/tiny/current"
TWIST, ODOMETRY = "geometry_msgs/msg/Twist", "nav_msgs/msg/Odometry"


@dataclass(frozen=True)
class Hosts:
    """The hosts of the lab, on which nodes of the swarm run."""

    lab: str
    graph: ExpectedGraph

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        namespace = f"--net={lab.operator(self.lab).namespace}"
        ssh = shlex.join(("nsenter", namespace, *lab.ssh_argv(self.lab, target.host, [])))
        yield LocalSession(os.environ, ("/bin/sh", "-c", f'exec {ssh} "$2"'))

    def diagnosis(self) -> Diagnosis:
        targets = {host.name: Target(host.name, host.address, host.account) for host in self.graph.hosts}
        return diagnose(self.graph, probe_hosts(self.graph, targets, self, parallel=2))

    def wrong(self) -> dict[str, str]:
        """What is not well in the graph, and has no other cause there."""
        return {
            one.key: one.message
            for one in self.diagnosis().findings
            if one.check in OF_THE_GRAPH and one.state not in (State.OK, State.SKIPPED)
            if (one.cause or "").partition(" ")[0] not in OF_THE_GRAPH
        }

    def run(self, host: str, unit: str, name: str, publishes: Any, subscribes: Any = ()) -> None:
        """Starts a node as a unit of the swarm does."""
        wanted = json.dumps({"name": name, "publishes": publishes, "subscribes": subscribes})
        words = (f"{CURRENT}/bin/ros-exec", "/usr/bin/python3", "/opt/node.py", wanted)
        account = ("--property=DynamicUser=yes", "--setenv=ROS_LOG_DIR=/tmp")
        start = (
            "systemd-run",
            "-q",
            "--collect",
            *account,
            f"--unit={unit}",
            f"--property=EnvironmentFile={CURRENT}/env/ros.env",
        )
        on(self.lab, host, shlex.join((*start, *words)))

    def stop(self, host: str, unit: str) -> None:
        on(self.lab, host, f"systemctl stop {unit}")

    def drive(self, host: ExpectedHost) -> None:
        """Starts a node that does what each driver of ``host`` should."""
        for robot in host.robots:
            topics = [{"topic": one.name, "type": one.type, "rate": one.rate} for one in robot.topics]
            commands = [{"topic": robot.command, "type": robot.command_type}]
            self.run(host.name, robot.unit, robot.node, topics, commands)


@pytest.fixture(scope="module")
def hosts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hosts]:
    try:
        image.ensure(quiet, distro="kilted")
    except ros_wheels.NoWheelsError as error:
        pytest.skip("; ".join((f"no image: {error}", *error.help_lines)))
    folder = tmp_path_factory.mktemp("status")
    (folder / "swarm.yaml").write_text(SPEC)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(paths.STATE_VARIABLE, str(folder))
        swarm, found = load_swarm(folder / "swarm.yaml")
        assert swarm is not None, found
        made = bundles(swarm)
        releases = {
            name: Release(one.digest, tuple(unit.name for unit in one.units)) for name, one in made.items()
        }
        with booted(with_distro(plan_of(swarm, name="ros2-status"), "kilted")) as name:
            seen = Hosts(name, expected_graph(swarm, releases))
            _start(seen, made)
            yield seen


def _start(hosts: Hosts, made: Mapping[str, Bundle]) -> None:
    for host in hosts.graph.hosts:
        packed = base64.b64encode(_archive(made[host.name])).decode()
        for start in range(0, len(packed), 90_000):
            on(hosts.lab, host.name, f"echo -n {packed[start : start + 90_000]} >> /opt/packed")
        on(hosts.lab, host.name, f"mkdir -p {CURRENT}; base64 -d /opt/packed | tar xz -C {CURRENT}")
        on(hosts.lab, host.name, f"cat > /opt/node.py <<'END'\n{NODE}\nEND")
    server = f"{CURRENT}/units/swarm-tiny.discovery.service"
    on(
        hosts.lab,
        "alpha",
        f"cp {server} /etc/systemd/system; systemctl daemon-reload; systemctl start swarm-tiny.discovery",
    )
    for host in hosts.graph.hosts:
        hosts.drive(host)
    wait_for(lambda: not hosts.wrong(), complaint="the swarm never becomes healthy")


def _archive(bundle: Bundle) -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as archive:
        for file in bundle.files:
            entry = tarfile.TarInfo(file.path)
            entry.size, entry.mode = len(file.content), file.mode
            archive.addfile(entry, io.BytesIO(file.content))
    return stream.getvalue()


@in_a_lab
def test_a_healthy_swarm_is_seen_whole_and_nothing_stays_behind(hosts: Hosts) -> None:
    before = on(hosts.lab, "beta", "ls /dev/shm /run /tmp")
    found = {one.key: one.message for one in hosts.diagnosis().findings}
    assert found["driver k3"] == "/k3/driver runs"
    assert found["report k3"] == "drives /k3/driver"
    assert found["discovery alpha"] == found["discovery beta"] == "sees 2 nodes"
    assert found["topic /k3/odom of k3"].startswith("measured ")
    assert on(hosts.lab, "beta", "ls /dev/shm /run /tmp") == before
    assert on(hosts.lab, "beta", "pgrep -f ros2_probe[.]look || echo none") == "none"


COMMANDS = {"topic": "/k3/cmd_vel", "type": TWIST, "rate": 10}
ODOM = {"topic": "/k3/odom", "type": ODOMETRY, "rate": 10}
#: By what a node does: its host, its name, what it publishes and subscribes, and what status finds.
NODES: Mapping[str, tuple[str, str, list[Any], list[Any], dict[str, str]]] = {
    "commands": (
        "beta", "/intruder", [{**COMMANDS, "topic": "/koala/cmd_vel"}], [],
        {"authority koala": "unauthorised publisher /intruder on 10.91.1.2 on /koala/cmd_vel"},
    ),
    "commands as tools do": (
        "alpha", "/_ros2cli_12", [COMMANDS], [],
        {"authority k3": "unauthorised publisher /_ros2cli_12 on 10.91.1.1 on /k3/cmd_vel"},
    ),
    "has the driver's name": (
        "alpha", "/k3/driver", [ODOM], [],
        {"node name /k3/driver": "several nodes are called /k3/driver, on hosts alpha and beta"},
    ),
    "publishes what the driver does": (
        "alpha", "/second", [ODOM], [],
        {"publisher /k3/odom": "/second on 10.91.1.1 publishes it as well as /k3/driver"},
    ),
    "expects another type": (
        "alpha", "/picky", [], [{"topic": "/k3/odom", "type": TWIST}],
        {
            "type /k3/odom of /k3/driver to /picky": f"it subscribes to {TWIST}, "
            f"and the publisher sends {ODOMETRY}"
        },
    ),
    "offers too little": (
        "alpha", "/careless", [{**COMMANDS, "reliability": "BEST_EFFORT"}], [],
        {
            "authority k3": "/careless",
            "qos /k3/cmd_vel of /careless to /k3/driver": "Best effort publisher and reliable subscription",
        },
    ),
}  # fmt: skip


def found(hosts: Hosts, wanted: Mapping[str, str]) -> bool:
    wrong = hosts.wrong()
    return wrong.keys() == wanted.keys() and all(text in wrong[key] for key, text in wanted.items())


@in_a_lab
@pytest.mark.parametrize("what", NODES)
def test_a_node_that_should_not_is_found(hosts: Hosts, what: str) -> None:
    host, name, publishes, subscribes, wanted = NODES[what]
    hosts.run(host, "other", name, publishes, subscribes)
    try:
        wait_for(lambda: found(hosts, wanted), complaint=f"not found: {wanted}")
    finally:
        hosts.stop(host, "other")
    wait_for(lambda: not hosts.wrong(), complaint="it stays")


@in_a_lab
@pytest.mark.parametrize(
    ("service", "kind", "wanted"),
    [
        ("/k3/driver/get_parameters", "rcl_interfaces/srv/GetParameters", {}),
        ("/k3/dock", "own_msgs/srv/Dock", {"driver k3": "/k3/driver does not provide /k3/dock"}),
        (
            "/k3/driver/get_parameters",
            "own_msgs/srv/Get",
            {"driver k3": "as rcl_interfaces/srv/GetParameters instead of own_msgs/srv/Get"},
        ),
    ],
)
def test_a_service_that_the_spec_declares_is_looked_for(
    hosts: Hosts, service: str, kind: str, wanted: Mapping[str, str]
) -> None:
    alpha, beta = hosts.graph.hosts
    robots = tuple(replace(one, provides=((service, kind),)) for one in beta.robots)
    declared = replace(hosts, graph=replace(hosts.graph, hosts=(alpha, replace(beta, robots=robots))))
    wait_for(lambda: found(declared, wanted), complaint=f"not found: {wanted}")


@in_a_lab
def test_a_host_without_rclpy_is_a_finding(hosts: Hosts) -> None:
    on(hosts.lab, "beta", "mv /opt/ros /opt/away")
    try:
        wrong = hosts.wrong()
    finally:
        on(hosts.lab, "beta", "mv /opt/away /opt/ros")
    assert wrong == {"probe beta ros": "rclpy cannot be imported: No module named 'rclpy'"}


@in_a_lab
def test_a_server_that_is_stopped_is_the_cause_of_all(hosts: Hosts) -> None:
    on(hosts.lab, "alpha", "systemctl stop swarm-tiny.discovery")
    causes = {one.key: one.cause for one in hosts.diagnosis().findings if one.state is State.BAD}
    server = "unit swarm-tiny.discovery.service on alpha"
    assert causes[server] is None
    symptoms = ("discovery alpha", "discovery beta", "driver koala", "driver k3")
    assert {causes[key] for key in symptoms} == {server}
