"""A robot that a ROS package drives: what its unit runs, and what its node reads."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from swarmctl.render import expected_nodes
from swarmctl.render.bundle import Bundle
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
  arm:
    title: Base of a vendor
    driver:
      package: vendor_driver
      executable: driver
      environment: {MODEL: "{robot}"}
      params:
        rate: 30
        controllers:
          base: {odom_frame: "{frame}/odom", joints: ["{frame}_left", 1, true]}
    kinematics: {kind: differential, linear_max: 0.5, angular_max: 2.0, wheel_separation: 0.14}
robots:
  tb3-01: {type: turtlebot3-burger, host: laptop}
  arm-1: {type: arm, host: laptop}
"""


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    return bundle_of(tmp_path_factory.mktemp("spec"), SPEC, "laptop")


def test_roslaunch_has_the_variables_that_a_launch_file_reads(host: Bundle) -> None:
    """`$(env NAME)` of an included file is evaluated by roslaunch, which ignores the tags `<env>` for it."""
    unit = text_of(host, "units/swarm-lab.tb3-01.service")
    assert "/usr/bin/env TURTLEBOT3_MODEL=burger LDS_MODEL=LDS-01 roslaunch" in unit
    launched = text_of(host, "launch/tb3-01.launch")
    assert "export the variables below" in launched
    assert '<env name="LDS_MODEL" value="LDS-01" />' in launched


def test_only_the_node_of_an_executable_has_its_variables(host: Bundle) -> None:
    assert " roslaunch " in text_of(host, "units/swarm-lab.arm-1.service")
    assert "MODEL" not in text_of(host, "units/swarm-lab.arm-1.service")
    assert '<env name="MODEL" value="arm-1" />' in text_of(host, "launch/arm-1.launch")


@pytest.mark.parametrize("robot", ["tb3-01", "arm-1"])
def test_a_urdf_is_loaded_in_the_namespace_of_its_robot(tmp_path: Path, robot: str) -> None:
    """After the vendor's launch file, which may load one of its own."""
    (tmp_path / "own.urdf").write_text('<robot name="own"><link name="base_link" /></robot>')
    spec = SPEC.replace("host: laptop}", "host: laptop, urdf: own.urdf}")
    bundle = bundle_of(tmp_path, spec, "laptop")
    assert text_of(bundle, f"urdf/{robot}.urdf") == (tmp_path / "own.urdf").read_text()
    (group,) = ElementTree.fromstring(text_of(bundle, f"launch/{robot}.launch")).iter("group")
    last = list(group)[-1]
    assert group.get("ns") == robot.replace("-", "_")
    assert (last.get("name"), last.get("textfile")) == (
        "robot_description", f"/opt/swarm/lab/current/urdf/{robot}.urdf",
    )  # fmt: skip
    (unit,) = (one for one in bundle.units if one.name == f"swarm-lab.{robot}.service")
    assert f"urdf/{robot}.urdf" in unit.needs


def test_without_a_urdf_none_is_loaded(host: Bundle) -> None:
    assert "robot_description" not in text_of(host, "launch/tb3-01.launch")
    assert not [one.path for one in host.files if one.path.startswith("urdf/")]


def test_placeholders_within_lists_and_mappings_are_filled(host: Bundle) -> None:
    read = yaml.safe_load(text_of(host, "params/arm-1.yaml"))
    assert read["rate"] == 30
    assert read["controllers"]["base"] == {"odom_frame": "arm_1/odom", "joints": ["arm_1_left", 1, True]}


def test_an_unknown_placeholder_within_a_mapping_is_found(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC.replace("{frame}/odom", "{frames}/odom"))
    _, found = load_swarm(spec)
    (error,) = found
    assert "`{frames}` is not a placeholder" in error.message
    assert error.span is not None
    assert error.span.line == SPEC[: SPEC.index("odom_frame")].count("\n") + 1


VEHICLES = """\
version: 1
name: lab
mode: single-minded
leader: laptop
ros: {distro: DISTRO}
hosts:
  laptop: {address: 192.168.77.10}
robots:
  uav-[1-2]: {type: TYPE, host: laptop}
links:
  - {kind: wlan, name: lab, hosts: [laptop]}
  - {kind: udp, host: laptop, robot: uav-1, address: 192.168.77.31}
  - {kind: udp, host: laptop, robot: uav-2, address: 192.168.77.32, local_ports: [8889]SYSTEM}
"""


def vehicles(tmp_path: Path, kind: str, distro: str, system: str = "") -> Bundle:
    spec = VEHICLES.replace("TYPE", kind).replace("DISTRO", distro).replace("SYSTEM", system)
    return bundle_of(tmp_path, spec, "laptop")


def test_each_px4_of_a_host_has_an_agent_on_the_port_of_its_link(tmp_path: Path) -> None:
    """An agent has no node of its own: those of the firmware are found by their topics."""
    host = vehicles(tmp_path, "px4", "jazzy")
    for robot, port in (("uav-1", 8888), ("uav-2", 8889)):
        unit = text_of(host, f"units/swarm-lab.{robot}.service")
        assert f"micro_ros_agent micro_ros_agent udp4 -p {port} --ros-args" in unit
    swarm, _ = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None
    assert [expected_nodes.driver(swarm, one).node for one in swarm.robots.values()] == ["", ""]


@pytest.mark.parametrize("kind", ["mavros-px4", "mavros-apm"])
@pytest.mark.parametrize(("distro", "file"), [("noetic", "launch"), ("jazzy", "launch.xml")])
def test_mavros_talks_to_the_system_of_the_link(tmp_path: Path, kind: str, distro: str, file: str) -> None:
    """mavros_node.cpp of ROS 2 names its topics /uas and the system id."""
    host = vehicles(tmp_path, kind, distro, ", system_id: 7")
    for robot, system in (("uav-1", 1), ("uav-2", 7)):
        launched = text_of(host, f"launch/{robot}.{file}")
        assert f'<arg name="tgt_system" value="{system}" />' in launched
        assert f'from="/uas{system}/mavlink_source" to="uas{system}/mavlink_source"' in launched
