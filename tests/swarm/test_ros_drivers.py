"""Robots that a ROS package drives: from the spec to the resolved swarm."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from swarmctl.diagnostics import Diagnostic
from swarmctl.rulebook import Severity
from swarmctl.swarm.resolved import ForeignDriver, Robot, SwarmctlDriver
from tests.loading import load_swarm

SPEC = """
version: 1
name: lab
mode: leader
leader: base
hosts:
  base: {address: 192.168.77.10, bluetooth: [hci0]}
types:
  burger:
    title: TurtleBot3 Burger
    driver:
      package: turtlebot3_bringup
      launch: turtlebot3_robot.launch
      args: {multi_robot_name: "{namespace}", address: "{address}", name: "{robot}"}
      environment: {TURTLEBOT3_MODEL: burger}
      publishes: [{topic: odom, type: nav_msgs/Odometry, rate: 30.0}]
    kinematics: {kind: differential, linear_max: 0.22, angular_max: 2.84}
  pioneer:
    title: Pioneer 3-DX
    driver:
      package: rosaria
      executable: RosAria
      params: {port: "{device}", baud: "{baud}"}
      remap: {pose: odom}
      publishes:
        - {topic: pose, type: nav_msgs/Odometry, rate: 10.0}
        - {topic: ~bumper, type: rosaria/BumperState}
    kinematics: {kind: differential, linear_max: 1.2, angular_max: 5.0}
    link: {kinds: [serial], baud: 9600}
robots:
  tb3-01: {type: burger, host: base, settings: {limits: {linear: 0.1}, command_timeout: 0.3}}
  p3: {type: pioneer, host: base}
  rover: {type: arduino-rover, host: base, driver: rosserial_python}
  k3: {type: khepera3, host: base}
links:
  - {kind: serial, host: base, robot: p3, usb: {serial: P3DX1234}}
  - {kind: serial, host: base, robot: rover, usb: {serial: "75830303934351E0D1B1"}}
  - {kind: bluetooth, host: base, robot: k3, mac: "10:00:E8:C5:64:37"}
"""


def read(folder: Path, text: str) -> tuple[dict[str, Robot], list[Diagnostic]]:
    path = folder / "swarm.yaml"
    path.write_text(text, "utf-8")
    swarm, found = load_swarm(path)
    return dict(swarm.robots) if swarm else {}, list(found)


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Robot]:
    found, diagnostics = read(tmp_path_factory.mktemp("swarm"), SPEC)
    assert found, diagnostics
    return found


def foreign(robot: Robot) -> ForeignDriver:
    assert isinstance(robot.driver, ForeignDriver)
    return robot.driver


def test_arguments_are_those_of_the_robot(robots: dict[str, Robot]) -> None:
    assert foreign(robots["tb3-01"]).ros.args == {
        "multi_robot_name": "tb3_01", "address": "192.168.77.10", "name": "tb3-01",
    }  # fmt: skip


def test_a_robot_of_a_launch_file_needs_no_line(robots: dict[str, Robot]) -> None:
    assert robots["tb3-01"].line is None


def test_its_limits_and_its_timeout_are_those_of_the_gate(robots: dict[str, Robot]) -> None:
    driver = foreign(robots["tb3-01"])
    assert driver.motion.axes == (0.1, 0.0, 0.0, 2.84)
    assert (driver.command_timeout, driver.gated) == (0.3, True)


def test_the_line_of_a_type_is_the_node_s_port(robots: dict[str, Robot]) -> None:
    assert foreign(robots["p3"]).ros.params == {"port": "/dev/swarm/p3", "baud": 9600}


def test_topics_have_the_names_after_the_remaps(robots: dict[str, Robot]) -> None:
    assert [(one.name, one.rate) for one in robots["p3"].topics] == [("odom", 10.0), ("driver/bumper", 0.0)]


def test_a_board_s_topics_are_those_of_its_sketch(robots: dict[str, Robot]) -> None:
    assert [one.name for one in robots["rover"].topics] == ["lwheel", "rwheel"]
    assert foreign(robots["rover"]).ros.params == {"port": "/dev/swarm/rover", "baud": 57600}
    assert foreign(robots["rover"]).ros.stops_after == 0.4


def test_other_robots_keep_swarmctl_s_driver(robots: dict[str, Robot]) -> None:
    assert isinstance(robots["k3"].driver, SwarmctlDriver)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "{robot}",
            "{rob}",
            r"`\{rob\}` is not a placeholder",
        ),
        ("{address}", "{device}", r"`\{device\}` is not available for robot `tb3-01`"),
        ("executable: RosAria", "stops_after: 0.6", "add `executable: NODE`|has no|`executable`"),
        ("executable: RosAria", "executable: RosAria\n      ungated: true", "`ungated` needs a `reason`"),
        ("package: rosaria", "package: rosaria\n      reason: none", "`reason` belongs to `ungated: true`"),
        (
            "executable: RosAria",
            "executable: RosAria\n      namespace_argument: ns",
            "only a launch file has arguments",
        ),
        (
            "launch: turtlebot3_robot.launch",
            "launch: turtlebot3_robot.launch\n      namespace_argument: multi_robot_name",
            "`multi_robot_name` gets the namespace by `namespace_argument`",
        ),
        ("linear_max: 1.2, ", "", "`linear_max` of differential kinematics is missing"),
        (
            "linear_max: 1.2",
            "linear_max: 1.2, lateral_max: 1.0",
            "differential kinematics has no `lateral_max`",
        ),
        (
            "type: pioneer, ",
            "type: pioneer, driver: swarmctl, ",
            "has no protocol that swarmctl's driver knows",
        ),
        (
            "type: pioneer, ",
            "type: pioneer, driver: rosaria, ",
            "`driver` in `p3`|`driver` cannot be `rosaria`",
        ),
    ],
)
def test_a_mistake_is_found_at_its_place(old: str, new: str, message: str, tmp_path: Path) -> None:
    assert old in SPEC
    _, found = read(tmp_path, SPEC.replace(old, new))
    [finding] = [one for one in found if one.severity is Severity.ERROR]
    assert re.search(message, finding.message), finding.message
    assert finding.span is not None


BY_DISTRO = """
version: 1
name: lab
mode: central
hub: base
ros: {distro: DISTRO}
hosts: {base: {address: 192.168.77.10}}
types:
  burger:
    title: TurtleBot3 Burger
    driver:
      - {distros: [noetic], package: turtlebot3_bringup, launch: turtlebot3_robot.launch}
      - distros: [humble, jazzy]
        package: turtlebot3_bringup
        launch: robot.launch.py
        namespace_argument: namespace
        args: {usb_port: "/dev/{robot}"}
    kinematics: {kind: differential, linear_max: 0.22, angular_max: 2.84}
robots: {tb3-01: {type: burger, host: base}}
"""


@pytest.mark.parametrize(
    ("distro", "launched", "args"),
    [
        ("noetic", "turtlebot3_robot.launch", ()),
        ("jazzy", "robot.launch.py", {"namespace": "tb3_01", "usb_port": "/dev/tb3-01"}),
    ],
)
def test_the_driver_is_that_of_the_distribution(
    tmp_path: Path, distro: str, launched: str, args: object
) -> None:
    driver = foreign(read(tmp_path, BY_DISTRO.replace("DISTRO", distro))[0]["tb3-01"])
    assert (driver.ros.launch, driver.ros.args) == (launched, args)


@pytest.mark.parametrize(
    ("old", "new", "message", "line"),
    [
        ("DISTRO", "kilted", "`turtlebot3_bringup`, the driver of robot `tb3-01`, is not for `kilted`", 12),
        ("{robot}", "{device}", "`{device}` is not available for robot `tb3-01`", 17),
        ("{distros: [noetic], ", "{", "`distros` is missing", 12),
        ("[noetic]", "[noetic, jazzy]", "an earlier driver in the list is for `jazzy`", 13),
        ("[noetic]", "[noetik]", "entry 1 of `distros` cannot be `noetik`", 12),
    ],
)
def test_errors_of_a_list_of_drivers_point_into_it(
    tmp_path: Path, old: str, new: str, message: str, line: int
) -> None:
    text = BY_DISTRO.replace(old, new, 1).replace("DISTRO", "jazzy")
    robots, found = read(tmp_path, text)
    assert not robots
    assert [(one.span.line, message in one.message) for one in found if one.severity is Severity.ERROR] == [
        (line, True)
    ], found
