"""Mode combined: each island has its own mode, each host is in the graph of its island or in none."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.swarm.resolved import Swarm
from tests.loading import load_swarm

SPEC = """
version: 1
name: nested
mode: combined
hosts:
  gate: {address: gate.uni.example, user: jdoe}
  desk: {address: 192.168.77.10, via: gate, bluetooth: [hci0], master_port: 11411}
  spare: {address: 192.168.77.20}
  head: {address: 192.168.77.11}
  tail: {address: 192.168.77.12}
  lone: {address: 192.168.77.13}
robots:
  epuck: {type: epuck, host: desk}
  koala: {type: koala, host: head}
  k3: {type: khepera3, host: tail}
  k4: {type: khepera3, host: tail}
  k5: {type: khepera3, host: lone}
links:
  - {kind: wlan, name: lab, hosts: [desk, spare, head, tail, lone]}
  - {kind: bluetooth, host: desk, robot: epuck, mac: "10:00:e8:c5:64:37"}
  - {kind: serial, host: head, robot: koala, usb: {serial: K1}}
  - {kind: serial, host: tail, robot: k3, usb: {serial: K3}}
  - {kind: serial, host: tail, robot: k4, usb: {serial: K4}}
  - {kind: serial, host: lone, robot: k5, usb: {serial: K5}}
control:
  - {by: desk, of: [epuck, k3]}
  - {by: head, of: [koala, k3, k4], priority: 1}
islands:
  table: {mode: single-minded, leader: desk, hosts: [desk, spare]}
  train: {mode: leader, leader: head, hosts: [head, tail]}
  loner: {mode: central, hub: lone, hosts: [lone]}
multimaster: {provider: static, topics: [{topic: /k4/odom, to: [table, loner]}]}
"""
UNIT = "swarm-nested.{}.service"


@pytest.fixture(scope="module")
def swarm(tmp_path_factory: pytest.TempPathFactory) -> Swarm:
    path = tmp_path_factory.mktemp("nested") / "swarm.yaml"
    path.write_text(SPEC, "utf-8")
    found, diagnostics = load_swarm(path)
    assert found is not None, diagnostics
    return found


@pytest.fixture(scope="module")
def made(swarm: Swarm) -> Mapping[str, Bundle]:
    return bundles(swarm)


def test_in_a_single_minded_island_only_the_leader_runs_ros(swarm: Swarm, made: Mapping[str, Bundle]) -> None:
    assert {island.name: island.hosts for island in swarm.islands} == {
        "table": ("desk",), "train": ("head", "tail"), "loner": ("lone",),
    }  # fmt: skip
    assert made["spare"].files == made["gate"].files == ()


def test_every_host_uses_the_master_of_its_island(made: Mapping[str, Bundle]) -> None:
    masters = {
        host: line.removeprefix("ROS_MASTER_URI=").strip('"')
        for host, bundle in made.items()
        for file in bundle.files
        if file.path == "env/ros.env"
        for line in file.content.decode().splitlines()
        if line.startswith("ROS_MASTER_URI=")
    }
    assert masters == {
        "desk": "http://192.168.77.10:11411",
        "head": "http://192.168.77.11:11311",
        "tail": "http://192.168.77.11:11311",
        "lone": "http://192.168.77.13:11311",
    }


def test_masters_multimasters_and_drivers_run_where_they_belong(made: Mapping[str, Bundle]) -> None:
    parts = ("master", "multimaster", "epuck", "koala", "k3", "k4", "k5")
    runs = {
        host: [part for part in parts if UNIT.format(part) in [unit.name for unit in bundle.units]]
        for host, bundle in made.items()
    }
    assert runs == {
        "gate": [],
        "desk": ["master", "multimaster", "epuck"],
        "spare": [],
        "head": ["master", "multimaster", "koala"],
        "tail": ["k3", "k4"],
        "lone": ["master", "multimaster", "k5"],
    }


def test_only_topics_needed_elsewhere_are_bridged(swarm: Swarm) -> None:
    """Two robots of one host: one is commanded from another island, the other from its own."""
    assert [(one.topic, one.origin, one.to) for one in swarm.bridges] == [
        ("/k3/cmd_vel", "table", ("train",)),
        ("/k4/odom", "train", ("table", "loner")),
    ]
    assert swarm.uri_hosts_of(swarm.islands[1]) == ("192.168.77.11", "head", "192.168.77.12", "tail")


def test_a_master_restarts_for_a_new_island_not_for_a_new_member(tmp_path: Path) -> None:
    """A ROS master never drops a node that died without unregistering: a new island would inherit it."""

    def digest(text: str) -> str:
        (tmp_path / "swarm.yaml").write_text(text, "utf-8")
        swarm, diagnostics = load_swarm(tmp_path / "swarm.yaml")
        assert swarm is not None, diagnostics
        units = bundles(swarm)["head"].manifest["units"]
        return next(str(unit["digest"]) for unit in units if unit["name"] == UNIT.format("master"))

    assert digest(SPEC) == digest(
        SPEC.replace("[desk, spare]", "[desk]").replace("[head, tail]", "[head, tail, spare]")
    )
    assert digest(SPEC) != digest(SPEC.replace("  train:", "  tram:"))
