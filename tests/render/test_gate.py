"""The gate in front of a robot's ROS package: what a host gets of it, and what the gate reads."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml
from swarm_onboard.command.battery_watch import NO_LIMITS, BatteryLimits
from swarm_onboard.command.start import Start
from swarm_onboard.gate.config import OUTPUT, Config, parse

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.render.ros1.noetic import NOETIC
from swarmctl.swarm import names
from tests.loading import load_swarm
from tests.render.rendered import bundle_of, text_of

SPEC = """\
version: 1
name: lab
mode: single-minded
leader: laptop
hosts:
  laptop: {address: 192.168.77.10}
types:
  burger:
    title: TurtleBot3 Burger
    driver:
      package: turtlebot3_bringup
      launch: turtlebot3_robot.launch
      requires: [turtlebot3_msgs]
    kinematics: {kind: differential, linear_max: 0.22, angular_max: 2.84, wheel_separation: 0.16}
  copter:
    title: a copter
    driver:
      package: mavros
      launch: px4.launch
      command: setpoint_velocity/cmd_vel
      command_type: geometry_msgs/TwistStamped
      ungated: true
      reason: its autopilot takes setpoints of many kinds
    kinematics: {kind: aerial, linear_max: 2.0, angular_max: 1.0}
robots:
  tb3-01:
    type: burger
    host: laptop
    start: {x: 1.5, y: -2, heading_deg: 90}
    settings: {command_timeout: 0.3, limits: {linear: 0.1}}
  uav: {type: copter, host: laptop}
control: [{by: laptop, of: [tb3-01, uav]}]
"""
UNIT = "swarm-lab.tb3-01.gate.service"


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    return bundle_of(tmp_path_factory.mktemp("spec"), SPEC, "laptop")


def test_the_gate_reads_its_robots_commanders_and_limits(host: Bundle) -> None:
    config = parse(yaml.safe_load(text_of(host, "params/tb3-01.gate.yaml")))
    assert (config.robot, config.node, config.output) == ("tb3-01", "/tb3_01/gate", "/tb3_01/gate/cmd_vel")
    assert (config.command_timeout, config.rate) == (0.3, 10.0)
    assert [one.addresses for one in config.commanders] == [("192.168.77.10",)]
    motion = config.motion
    assert (motion.linear_max, motion.angular_max, motion.wheel_separation) == (0.1, 2.84, 0.16)


@pytest.mark.parametrize(
    ("published", "battery", "docked"),
    [
        ("", "", ""),
        ("{topic: battery_state, type: sensor_msgs/BatteryState}", "/tb3_01/battery_state", ""),
        ("{topic: base/docked, type: std_msgs/Bool}", "", "/tb3_01/base/docked"),
        ("{topic: dock, type: std_msgs/Bool}, {topic: docked, type: std_msgs/Int8}", "", ""),
    ],
)
def test_the_gate_reads_the_battery_and_dock_of_the_driver(
    published: str, battery: str, docked: str, tmp_path: Path
) -> None:
    text = SPEC.replace("requires: [turtlebot3_msgs]", f"publishes: [{published}]")
    if battery or docked:
        text += f"maintenance: {{docked: true{', battery: 0.4' if battery else ''}}}\n"
        text = text.replace("uav: {type", "uav: {maintenance: {docked: false, battery: 0}, type")
    made = bundle_of(tmp_path, text, "laptop")
    config = parse(yaml.safe_load(text_of(made, "params/tb3-01.gate.yaml")))
    assert (config.battery, config.docked) == (battery, docked)
    assert any(one.path == "maintenance.json" for one in made.files) is bool(battery or docked)


def test_the_gate_stops_a_robot_by_its_battery(tmp_path: Path) -> None:
    text = SPEC.replace(
        "requires: [turtlebot3_msgs]", "publishes: [{topic: battery, type: sensor_msgs/BatteryState}]"
    )
    before = bundle_of(tmp_path, text, "laptop")
    assert parse(yaml.safe_load(text_of(before, "params/tb3-01.gate.yaml"))).battery_limits == NO_LIMITS
    text = text.replace("settings: {", "settings: {battery: {low: 0.3, empty: 0.2}, ")
    config = parse(yaml.safe_load(text_of(bundle_of(tmp_path, text, "laptop"), "params/tb3-01.gate.yaml")))
    assert config.battery_limits == BatteryLimits(low=0.3, empty=0.2)


def test_the_gate_places_the_drivers_odometry_frame_on_the_map(tmp_path: Path) -> None:
    def config(driver: str = "") -> Config:
        (tmp_path / "swarm.yaml").write_text(
            SPEC.replace("requires: [turtlebot3_msgs]", driver or "args: {}")
        )
        swarm, found = load_swarm(tmp_path / "swarm.yaml")
        assert swarm is not None, found
        return parse(yaml.safe_load(text_of(bundles(swarm)["laptop"], "params/tb3-01.gate.yaml")))

    assert config().start == Start(1.5, -2.0, pytest.approx(math.pi / 2))
    assert config().odom_frame == "odom"  # the driver is passed no prefix
    assert config('args: {multi_robot_name: "{frame}"}').odom_frame == "tb3_01/odom"
    assert config('odom_frame: "{frame}_odom"').odom_frame == "tb3_01_odom"


def test_gate_and_launch_file_use_the_same_topic(host: Bundle) -> None:
    assert names.GATE_OUTPUT == OUTPUT
    remap = '<remap from="/tb3_01/cmd_vel" to="/tb3_01/gate/cmd_vel" />'
    assert remap in text_of(host, "launch/tb3-01.launch")


def test_its_unit_starts_first_and_sends_a_zero_at_the_end(host: Bundle) -> None:
    order = [one.name for one in host.units]
    assert order.index(UNIT) < order.index("swarm-lab.tb3-01.service")
    unit = text_of(host, f"units/{UNIT}")
    assert "Before=swarm-lab.tb3-01.service\n" in unit
    assert "ExecStopPost=/usr/bin/python3 /opt/swarm/lab/current/gate/send_zero.py" in unit
    assert "Restart=always\n" in unit
    assert "DynamicUser=yes\n" in unit


def test_people_start_the_gate_with_the_driver(host: Bundle) -> None:
    assert "/launch/tb3-01.gate.launch" in text_of(host, "launch/swarm.launch")
    assert 'pkg="swarm_gate" type="gate.py"' in text_of(host, "launch/tb3-01.gate.launch")
    path = 'ROS_PACKAGE_PATH="/opt/swarm/lab/current/gate:/usr/share:/usr/lib"\n'
    assert path in text_of(host, "env/ros.env"), "there is no folder `drivers` here, which roswtf would miss"


def test_a_gate_needs_no_pyserial(host: Bundle) -> None:
    assert "rospy" in host.requires
    assert "pyserial" not in host.requires


def test_a_start_needs_the_messages_of_transforms(host: Bundle, tmp_path: Path) -> None:
    assert host.requires["tf2_msgs"] == ("robots.tb3-01",)
    hints = " ".join(NOETIC.install_hints(["tf2_msgs"]))
    assert "ros-noetic-tf2-msgs" in hints
    assert "python3-tf2-msgs" in hints
    without = "\n".join(line for line in SPEC.splitlines() if "start:" not in line)
    (tmp_path / "swarm.yaml").write_text(without)
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    assert "tf2_msgs" not in bundles(swarm)["laptop"].requires


def test_an_ungated_robot_gets_no_gate_and_keeps_its_topic(host: Bundle) -> None:
    assert not [one.path for one in host.files if "uav.gate" in one.path]
    assert "gate/cmd_vel" not in text_of(host, "launch/uav.launch")
