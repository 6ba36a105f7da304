"""What joins islands of ROS 2: a relay on each hub that receives something, with both islands in view."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests import ROOT
from tests.loading import load_swarm

GOLDEN = ROOT / "tests/render/golden/ros2/relay"
EXAMPLE = ROOT / "examples/ros2-4-standalone/swarm.yaml"
OF_RELAY = re.compile(r"params/relay\.yaml|env/relay\.|units/.*\.multimaster\.service")
CASES = {
    "jazzy": "distro: jazzy",
    "server": "distro: jazzy, discovery: server",
    "kilted": "distro: kilted",
    "cyclonedds": "distro: kilted, rmw: cyclonedds",
    "multicast": "distro: kilted, discovery: multicast",
    "zenoh": "distro: kilted, rmw: zenoh",
}


def made(folder: Path, ros: str, more: str = "") -> Mapping[str, Bundle]:
    spec = folder / "swarm.yaml"
    spec.write_text(EXAMPLE.read_text("utf-8").replace("{distro: jazzy}", f"{{{ros}}}") + more, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)


@pytest.mark.parametrize("case", CASES)
def test_golden(case: str, tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    for file in made(tmp_path, CASES[case])["k3-pi"].files:
        special = {"jazzy": (), "server": ("units/",), "zenoh": ("units/",)}.get(case, ("units/", "params/"))
        if OF_RELAY.match(file.path) and not file.path.startswith(special):
            golden(GOLDEN / case / file.path, file.content.decode())


def test_golden_of_a_relay_to_ros_1(golden: Callable[[Path, str], None]) -> None:
    swarm, found = load_swarm(ROOT / "examples/ros1-and-ros2/swarm.yaml")
    assert swarm is not None, found
    hosts = bundles(swarm)
    assert not any(OF_RELAY.match(file.path) for file in hosts["koala-laptop"].files)
    (params,) = (one for one in hosts["tb3-pi"].files if one.path == "params/relay.yaml")
    golden(GOLDEN / "ros1" / params.path, params.content.decode())
    assert {"package:nav_msgs", "package:sensor_msgs"} <= hosts["tb3-pi"].requires.keys()


def test_only_who_receives_a_topic_has_a_relay(tmp_path: Path) -> None:
    hosts = made(tmp_path, "distro: jazzy")
    with_relay = [host for host, one in hosts.items() if any(OF_RELAY.match(f.path) for f in one.files)]
    assert with_relay == ["k3-pi", "epuck-pi"]
    assert "package:geometry_msgs" in hosts["k3-pi"].requires


def test_a_declared_topic_brings_its_type(tmp_path: Path) -> None:
    more = "multimaster: {topics: [{topic: /koala/odom, to: [k3-pi]}]}\n"
    bundle = made(tmp_path, "distro: jazzy", more)["k3-pi"]
    (params,) = (file.content.decode() for file in bundle.files if file.path == "params/relay.yaml")
    assert "{topic: /koala/odom, type: nav_msgs/Odometry, command: false}" in params
    assert "package:nav_msgs" in bundle.requires


def test_every_need_is_a_file_of_the_bundle(tmp_path: Path) -> None:
    for bundle in made(tmp_path, "distro: kilted").values():
        paths = {file.path for file in bundle.files}
        assert {path for unit in bundle.units for path in unit.needs} <= paths
