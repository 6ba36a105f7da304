"""The URDF of each robot: one tree of links and joints, as large as the type says."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from swarmctl.render import driver_config
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import params_of
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.spec.catalog import load_catalog
from swarmctl.swarm.topics import WHEEL_JOINTS
from tests.render.rendered import bundle_of, text_of

TYPES = with_protocol(load_catalog().types)


def model_of(type_name: str, **settings: object) -> ElementTree.Element:
    params = params_of(
        TYPES[type_name], robot="r1", namespace="/r1", port="/dev/robot",
        settings=RobotSettings.model_validate(settings),
    )  # fmt: skip
    return ElementTree.fromstring(driver_config.urdf("r1", driver_config.model_of(params)))


@pytest.mark.parametrize("type_name", TYPES)
def test_it_is_one_tree_whose_names_are_without_the_robots(type_name: str) -> None:
    """robot_state_publisher and RViz put the `tf_prefix` before them."""
    model = model_of(type_name)
    links = [one.get("name", "") for one in model.iter("link")]
    children = [one.get("link", "") for one in model.iter("child")]
    assert model.get("name") == "r1"
    assert sorted(links) == sorted(["base_link", *children])
    assert {one.get("link") for one in model.iter("parent")} <= {"base_link"}
    assert not [
        name for name in (*links, *(one.get("name", "") for one in model.iter("joint"))) if "/" in name
    ]


@pytest.mark.parametrize("type_name", [name for name, one in TYPES.items() if one.kinematics.wheel_radius])
def test_its_joints_are_those_of_joint_states(type_name: str) -> None:
    joints = {one.get("name"): one for one in model_of(type_name).iter("joint")}
    assert tuple(joints) == WHEEL_JOINTS
    assert {one.get("type") for one in joints.values()} == {"continuous"}


def test_its_wheels_are_where_the_calibration_puts_them() -> None:
    model = model_of("epuck", calibration={"wheel_separation": 0.054, "distance_scale": 1.1})
    origins = {one.get("name"): one.find("origin") for one in model.iter("joint")}
    left, right = (origins[name] for name in WHEEL_JOINTS)
    assert left is not None
    assert right is not None
    assert (left.get("xyz"), right.get("xyz")) == ("0 0.027 0", "0 -0.027 0")
    wheel = next(one for one in model.iter("link") if one.get("name") == "left_wheel_link")
    cylinder = wheel.find("visual/geometry/cylinder")
    assert cylinder is not None
    assert float(cylinder.get("radius", 0)) == pytest.approx(0.02255)


def test_a_robot_of_which_only_the_tracks_are_known_has_a_body() -> None:
    bare = TYPES["koala"].kinematics.model_copy(update={"wheel_radius": None})
    stripped = TYPES["koala"].model_copy(update={"kinematics": bare, "sensors": {}})
    params = params_of(stripped, robot="r1", namespace="/r1", port="/dev/robot")
    model = ElementTree.fromstring(driver_config.urdf("r1", driver_config.model_of(params)))
    assert [one.get("name") for one in model.iter("link")] == ["base_link"]
    body = model.find("link/visual/geometry/cylinder")
    assert body is not None
    assert float(body.get("radius", 0)) == pytest.approx(TYPES["koala"].kinematics.wheel_separation / 2)


def test_a_urdf_beside_the_spec_replaces_it(tmp_path: Path) -> None:
    """The robot's own before that of its type; the file of the host is the user's, byte by byte."""
    own = '<robot name="own"><link name="base_link" /></robot>\n'
    (tmp_path / "own.urdf").write_text(own)
    spec = """version: 1
name: lab
mode: single-minded
leader: pi
time: {servers: [pool.ntp.org]}
hosts: {pi: {address: 192.168.77.12}}
robots:
  k-1: {type: khepera3, urdf: own.urdf}
  k-2: {type: khepera3}
links:
  - {kind: serial, host: pi, robot: k-1, usb: {serial: K1}}
  - {kind: serial, host: pi, robot: k-2, usb: {serial: K2}}
"""
    host = bundle_of(tmp_path, spec, "pi")
    assert text_of(host, "urdf/k-1.urdf") == own
    assert "right_wheel" in text_of(host, "urdf/k-2.urdf")
    assert "urdf: ../urdf/k-1.urdf" in text_of(host, "params/k-1.yaml")
