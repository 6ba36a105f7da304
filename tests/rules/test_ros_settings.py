"""The keys of `ros` beside its distribution."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.plugins import MIDDLEWARES
from tests.loading import load_swarm
from tests.seams.toy import Pebble
from tests.seams.toy_spec import SPEC


class Served(Pebble):
    """A middleware with discovery servers."""

    settings = frozenset({"rmw", "domain", "discovery", "servers"})


@pytest.fixture(autouse=True)
def served() -> Iterator[None]:
    MIDDLEWARES.register("served", Served())
    yield
    MIDDLEWARES.unregister("served")


def findings(folder: Path, ros: str, mode: str = "mode: central\nhub: koala-laptop") -> list[tuple[str, str]]:
    spec = folder / "swarm.yaml"
    text = SPEC.read_text("utf-8").replace("mode: standalone", mode)
    spec.write_text(f"{text}ros: {{distro: served, {ros}}}\n", "utf-8")
    return [(one.code, one.message) for one in load_swarm(spec)[1]]


@pytest.mark.parametrize(
    ("ros", "message"),
    [
        ("rmw: cyclonedds, discovery: server", "`cyclonedds` has no discovery `server`"),
        ("rmw: zenoh, discovery: local", "`zenoh` has no discovery `local`"),
        ("discovery: zenoh", "`fastrtps` has no discovery `zenoh`"),
        ("discovery: peers, servers: [k3-pi]", "discovery `peers` has no servers"),
        ("rmw: cyclonedds, servers: [k3-pi]", "discovery `peers` has no servers"),
    ],
)
def test_what_does_not_fit_together_is_an_error(tmp_path: Path, ros: str, message: str) -> None:
    [(_, found)] = findings(tmp_path, ros)
    assert found.startswith(message)


@pytest.mark.parametrize(
    "ros", ["rmw: zenoh, servers: [k3-pi]", "domain: 0, servers: [k3-pi]", "domain: 101"]
)
def test_what_fits_together_has_no_finding(tmp_path: Path, ros: str) -> None:
    assert findings(tmp_path, ros) == []


def test_an_unknown_server_is_an_error(tmp_path: Path) -> None:
    [(_, message)] = findings(tmp_path, "servers: [k3-pie]")
    assert "k3-pie" in message


def test_a_server_on_a_host_without_ros_is_an_error(tmp_path: Path) -> None:
    found = findings(tmp_path, "servers: [k3-pi]", mode="mode: single-minded\nleader: koala-laptop")
    assert ("ROS002", "`k3-pi` is to run a discovery server, and runs no ROS") in found


def test_keys_of_ros_1_have_no_effect_there(tmp_path: Path) -> None:
    assert findings(tmp_path, "naming: hosts") == [("ROS001", "`served` does not use `naming`")]


def test_packages_beside_the_spec_are_not_delivered(tmp_path: Path) -> None:
    (tmp_path / "nav").mkdir()
    (tmp_path / "nav/package.xml").write_text("<package><name>nav</name></package>", "utf-8")
    found = findings(tmp_path, "domain: 1}\npackages: {nav: {from: ./nav}")
    assert [code for code, _ in found] == ["ROS003"]
