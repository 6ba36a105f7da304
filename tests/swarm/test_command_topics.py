"""Where robots take commands: teleop, bridges, loads and checks use that topic and its message type."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from swarmctl.analysis.diagram import diagram
from swarmctl.analysis.host_load import host_budgets
from swarmctl.analysis.network_load import network_budgets
from swarmctl.linter.runner import lint
from swarmctl.render.build_bundle import bundles
from swarmctl.render.middleware import middleware_of
from swarmctl.spec.load import load
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import Swarm
from tests.swarm.documents import read

SPEC = """
version: 1
name: lab
mode: standalone
hosts:
  base: {address: 192.168.77.10, computer: raspberry-pi-4b}
  far: {address: 192.168.77.11, computer: raspberry-pi-4b}
types:
  stamped:
    title: Takes stamped velocities
    driver:
      package: vendor
      executable: node
      command: ~move
      command_type: geometry_msgs/TwistStamped
      remap: {~move: base/move}
      ungated: true
      reason: it has a mux of its own
    kinematics: {kind: holonomic, linear_max: 1.0, angular_max: 1.0}
  camera:
    title: Camera on a tripod
    driver: {package: cameras, executable: node}
    kinematics: {kind: none}
robots:
  s-1: {type: stamped, host: far}
  tb3: {type: turtlebot3-burger, host: far}
  eye: {type: camera, host: far}
links:
  - {kind: wlan, name: lab, hosts: [base, far]}
programs:
  keys: {use: teleop-joy, host: base, params: {device: /dev/input/js0}}
control:
  - {by: keys, of: [s-1, tb3]}
time: {root: base}
"""

#: As the controller of Nav2 is declared, and a robot whose driver takes no stamps.
NAV2 = """
version: 1
name: tw
mode: central
hub: pc
ros: {distro: jazzy}
hosts:
  pc: {address: 192.168.77.10, user: ros, computer: laptop}
  r1: {address: 192.168.77.21, user: ubuntu, computer: raspberry-pi-4b}
robots:
  tb-1: {type: create3, host: r1}
  k3: {type: khepera3, host: r1}
links:
  - {kind: wlan, name: lab, hosts: [pc, r1]}
  - {kind: serial, host: r1, robot: k3, usb: {serial: FTDI1234}}
  - {kind: udp, host: r1, robot: tb-1, address: 192.168.186.2, host_address: 192.168.186.3}
programs:
  nav:
    host: pc
    package: nav2_bringup
    executable: controller
    publishes:
      - {topic: /tb_1/cmd_vel, type: geometry_msgs/TwistStamped, rate: 10.0}
      - {topic: /k3/cmd_vel, type: geometry_msgs/TwistStamped, rate: 10.0}
control:
  - {by: nav, of: [tb-1, k3]}
"""


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> SwarmIndex:
    return SwarmIndex(read(tmp_path_factory.mktemp("swarm"), SPEC))


@pytest.fixture(scope="module")
def swarm(index: SwarmIndex) -> Swarm:
    return resolve(index.document)


def test_an_ungated_driver_keeps_its_own_command_topic(index: SwarmIndex) -> None:
    found = {robot: (one.topic, one.type) for robot, one in index.command_topics.items()}
    assert found == {
        "s-1": ("/s_1/base/move", "geometry_msgs/TwistStamped"),
        "tb3": ("/tb3/cmd_vel", "geometry_msgs/Twist"),
    }


def test_teleop_publishes_what_each_driver_takes(swarm: Swarm) -> None:
    bundle = bundles(swarm)["base"]
    params = next(one.content for one in bundle.files if one.path == "params/keys.yaml")
    assert yaml.safe_load(params)["targets"] == [
        {"robot": "s-1", "topic": "/s_1/base/move", "stamped": True},
        {"robot": "tb3", "topic": "/tb3/cmd_vel"},
    ]


def test_commands_of_other_islands_are_bridged_by_name(swarm: Swarm) -> None:
    found = {(one.topic, one.type, one.origin, one.to) for one in swarm.bridges if one.cause == "control[0]"}
    assert found == {
        ("/s_1/base/move", "geometry_msgs/TwistStamped", "base", ("far",)),
        ("/tb3/cmd_vel", "geometry_msgs/Twist", "base", ("far",)),
    }


def test_the_network_carries_the_real_command_topics(index: SwarmIndex) -> None:
    (budget,) = network_budgets(index)
    flows = {one.topic: one.bytes_per_second for one in budget.flows}
    assert flows["/s_1/base/move"] > flows["/tb3/cmd_vel"] > 0  # its header


def test_the_graph_shows_the_command_topic(index: SwarmIndex) -> None:
    labels = {one.end: one.label for one in diagram(index).edges if one.kind == "commands"}
    assert labels == {"robot:s-1": "base/move", "robot:tb3": "cmd_vel"}


def test_only_robots_with_a_gate_need_memory_for_it(index: SwarmIndex) -> None:
    (far,) = (one for one in host_budgets(index, ()) if one.host == "far")
    assert dict(far.parts)["1 gate"] == 40
    assert far.served == 4  # three drivers and the gate of tb3


def test_a_robot_that_takes_no_commands_has_no_gate(swarm: Swarm) -> None:
    units = {one.name for one in bundles(swarm)["far"].units}
    assert "swarm-lab.tb3.gate.service" in units
    assert not {"swarm-lab.eye.gate.service", "swarm-lab.s-1.gate.service"} & units
    assert swarm.robots["eye"].command is None


@pytest.mark.parametrize(
    ("published", "code", "help_"),
    [
        ("/s_1/base/move, type: geometry_msgs/TwistStamped", "AUTH004", "add to `control`"),
        ("/s_1/cmd_vel, type: geometry_msgs/Twist", "TOPIC005", "takes geometry_msgs/TwistStamped on"),
        ("/eye/cmd_vel, type: geometry_msgs/Twist", "TOPIC005", "takes no commands"),
        ("/s_1/base/move, type: geometry_msgs/Twist", "TOPIC001", "write the type"),
    ],
)
def test_wrong_commands_are_found(tmp_path: Path, published: str, code: str, help_: str) -> None:
    wander = (
        "programs:\n  wander: {host: base, package: wander, executable: wander, "
        f"publishes: [{{topic: {published}}}]}}\n"
    )
    document = read(tmp_path, SPEC.replace("programs:\n", wander))
    found = {one.code: one for one in lint(document)}
    assert code in found, found
    assert any(help_ in line for line in found[code].help), found[code].help


@pytest.mark.parametrize(
    ("driver", "problem"),
    [
        ("{package: a, executable: b, command_type: a_msgs/Hover}", "the gate sends"),
        ('{package: a, launch: b.launch, command: "~go", ungated: true, reason: why}', "is private to"),
    ],
)
def test_drivers_without_usable_commands_are_errors(tmp_path: Path, driver: str, problem: str) -> None:
    path = tmp_path / "swarm.yaml"
    path.write_text(SPEC.replace("{package: cameras, executable: node}", driver), "utf-8")
    document, found = load([path])
    assert document is None
    assert any(problem in one.message for one in found), found


TWIST, STAMPED = "geometry_msgs/Twist", "geometry_msgs/TwistStamped"


@pytest.mark.parametrize(
    ("settings", "declared", "kind"),
    [
        ("", (), TWIST),
        ("", (TWIST,), TWIST),
        ("", (STAMPED, STAMPED), STAMPED),
        ("", (TWIST, STAMPED), TWIST),
        ("", ("std_msgs/String",), TWIST),
        (f"settings: {{command_type: {STAMPED}}}", (), STAMPED),
        (f"settings: {{command_type: {STAMPED}}}", (TWIST,), STAMPED),
        (f"settings: {{command_type: {TWIST}}}", (STAMPED,), TWIST),
    ],
)
@pytest.mark.parametrize("robot", ["tb3: {type: turtlebot3-burger,", "k3: {type: khepera3,"])
def test_the_type_is_that_of_the_settings_else_of_all_programs(
    tmp_path: Path, robot: str, settings: str, declared: tuple[str, ...], kind: str
) -> None:
    name = robot.partition(":")[0]
    programs = "".join(
        f"  p{number}: {{host: base, package: a, executable: b, publishes: "
        f"[{{topic: go, type: {one}}}], remap: {{go: /{name}/cmd_vel}}}}\n"
        for number, one in enumerate(declared)
    )
    text = SPEC.replace("tb3: {type: turtlebot3-burger,", f"{robot} {settings}{', ' if settings else ''}")
    text = text.replace("programs:\n", "programs:\n" + programs).replace(
        "of: [s-1, tb3]", f"of: [s-1, {name}]"
    )
    index = SwarmIndex(read(tmp_path, text))
    assert index.command_topics[name].type == kind
    assert index.command_topics["s-1"].type == STAMPED
    sent = {one.type for one in index.endpoints if one.owner == "keys" and one.topic == f"/{name}/cmd_vel"}
    assert sent == {kind}


def test_defaults_say_the_type_of_all_robots(tmp_path: Path) -> None:
    defaults = f"defaults: {{robot: {{command_type: {STAMPED}}}}}\nrobots:\n"
    index = SwarmIndex(read(tmp_path, SPEC.replace("robots:\n", defaults)))
    assert index.command_topics["tb3"].type == STAMPED


def test_gate_driver_and_status_take_the_stamps_of_nav2(tmp_path: Path) -> None:
    """A program declares TwistStamped for two robots of Jazzy; the driver of one is swarmctl's own."""
    path = tmp_path / "swarm.yaml"
    path.write_text(NAV2, "utf-8")
    document, found = load([path])
    assert document is not None, found
    assert [one.code for one in lint(document) if one.severity == "error"] == []
    made = bundles(resolve(document))
    files = {one.path: one.content for one in made["r1"].files}
    gate, driver = (yaml.safe_load(files[f"params/{name}.yaml"]) for name in ("tb-1.gate", "k3"))
    assert (gate["command_type"], gate["output_type"]) == (STAMPED, TWIST)
    assert driver["command_type"] == STAMPED
    middleware = middleware_of("jazzy")
    swarm = resolve(document)
    for robot in swarm.robots.values():
        assert middleware.driver(swarm, robot).command_type == "geometry_msgs/msg/TwistStamped"
