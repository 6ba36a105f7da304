"""Drivers of ROS packages that open one device of a host, or publish one transform under one master."""

from __future__ import annotations

import pytest

from swarmctl.linter.runner import lint
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text

SPEC = """
version: 1
name: carts
mode: MODE
hosts: {desk: {address: 192.168.77.10}, pi: {address: 192.168.77.11}}
types:
  cart:
    title: A cart
    driver: {package: cart, executable: cart, DRIVER}
    kinematics: {kind: differential, linear_max: 0.5, angular_max: 1.0}
    link: {kinds: [serial], baud: 9600}
robots: {a: {type: cart, host: desk}, b: {type: cart, host: HOST}}
links:
- {kind: ethernet, name: lab, hosts: [desk, pi]}
- {kind: serial, host: desk, robot: a, device: /dev/ttyS0}
- {kind: serial, host: HOST, robot: b, usb: {serial: FTDI5678}}
"""
PROGRAM = "\nprograms: {lidar: {host: desk, package: lidar, executable: lidar, "
TWO = (
    PROGRAM + "params: {port: PORT}}, "
    "other: {host: desk, package: lidar, executable: lidar, params: {port: PORT}}}"
)
BY_PATH = "/dev/serial/by-path/x-0:1:1.0"
REL = "{/tf: tf}"
TF = "{topic: /tf, type: tf2_msgs/TFMessage, rate: 1.0, size: 100}"
JOINED = PROGRAM + f"publishes: [{TF}]}}}}\nmultimaster: {{topics: [{{topic: /tf, to: [pi]}}]}}"


def messages(code: str, driver: str, more: str = "", host: str = "desk", mode: str = "central") -> list[str]:
    known = {"MODE": mode + ("\nhub: desk" if mode == "central" else ""), "DRIVER": driver, "HOST": host}
    text = SPEC
    for word, value in known.items():
        text = text.replace(word, value)
    document, problems = load_text(text + more, "swarm.yaml", load_catalog())
    assert document is not None, problems
    return [one.message for one in lint(document) if one.code == code]


@pytest.mark.parametrize(
    ("driver", "more", "owners", "device"),
    [
        ("params: {port: /dev/ttyACM0}", "", "a b", "/dev/ttyACM0"),
        ("params: {ports: {front: ['/dev/ttyACM0']}}", "", "a b", "/dev/ttyACM0"),
        ("args: ['--port=/dev/ttyACM0', x]", "", "a b", "/dev/ttyACM0"),
        ("params: {fcu_url: 'serial:///dev/ttyACM0:57600'}", "", "a b", "/dev/ttyACM0"),
        ("params: {fcu_url: '/dev/ttyACM0:57600'}", "", "a b", "/dev/ttyACM0"),
        ("devices: [/dev/cart]", "", "a b", "/dev/cart"),
        ("params: {port: '{device}'}", "", "", ""),
        ("params: {port: '/dev/{robot}'}", "", "", ""),
        ("params: {port: /dev/input/js0}", "", "", ""),
        ("params: {map: /home/robot/dev/map}", "", "", ""),
        ("params: {port: '/dev/{robot}'}", PROGRAM + "params: {port: /dev/b}}}", "b lidar", "/dev/b"),
        ("params: {port: '{device}'}", PROGRAM + "params: {port: /dev/ttyS0}}}", "a lidar", "/dev/ttyS0"),
        ("params: {port: '{device}'}", PROGRAM + "args: [/dev/swarm/b]}}", "b lidar", "/dev/swarm/b"),
        ("params: {port: '{device}'}", PROGRAM + "args: [/dev/swarm/c]}}", "", ""),
        ("params: {port: '{device}'}", TWO.replace("PORT", "/dev/rplidar"), "lidar other", "/dev/rplidar"),
        ("params: {port: '{device}'}", TWO.replace("PORT", "'/dev/{program}'"), "", ""),
        ("params: {port: '{device}'}", TWO.replace("PORT", BY_PATH), "lidar other", BY_PATH),
        ("params: {port: '/dev/{namespace}', other: '/dev/{robot}'}", "", "", ""),
    ],
)  # fmt: skip
def test_one_device_of_two_owners(driver: str, more: str, owners: str, device: str) -> None:
    both = " and ".join(f"{'robot' if len(one) == 1 else 'program'} `{one}`" for one in owners.split())
    wanted = [f"{both} open one device of host `desk`, `{device}`"] if owners else []
    assert messages("ID002", driver, more) == wanted


def test_devices_of_two_hosts_differ() -> None:
    assert messages("ID002", "params: {port: /dev/ttyACM0}", host="pi") == []


def test_the_line_of_a_robot_and_the_param_of_another() -> None:
    found = messages("ID002", "params: {port: /dev/ttyS0}")
    assert found == ["robot `a` and robot `b` open one device of host `desk`, `/dev/ttyS0`"]


@pytest.mark.parametrize(
    ("driver", "what"),
    [
        ("params: {base_frame: base_link}", "one transform, `odom` to `base_link`"),
        ("params: {base_frame_id: base, odom_frame_id: o}", "one transform, `o` to `base`"),
        ("base_frame: base_link, odom_frame: map", "one transform, `map` to `base_link`"),
        (
            "params: {base_frame: base_link, odom_frame: '{frame}/odom'}",
            "transforms to one frame, `base_link`",
        ),
        ("params: {base_frame: base_link, tf_prefix: x}", "one transform, `x/odom` to `x/base_link`"),
        ("params: {base_frame: base_link, publish_tf: false}", ""),
        ("params: {base_frame: base_link, tf_prefix: '{frame}'}", ""),
        ("params: {base_frame: '{robot}_base'}", ""),
        (f"params: {{base_frame: base_link}}, remap: {REL}", ""),
        ("base_frame: '{frame}/base_link'", ""),
        ("publishes: [{topic: odom, type: nav_msgs/Odometry}]", ""),
    ],
)
def test_one_transform_of_two_drivers(driver: str, what: str) -> None:
    wanted = [f"the drivers of 2 robots of one master publish {what}"] if what else []
    assert messages("DRIVER003", driver) == wanted


@pytest.mark.parametrize(("more", "count"), [("", 0), (JOINED, 1)])
def test_masters_that_exchange_transforms(more: str, count: int) -> None:
    found = messages("DRIVER003", "base_frame: base_link", more, host="pi", mode="standalone")
    assert len(found) == count
