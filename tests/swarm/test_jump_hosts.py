"""A host used only as SSH jump host runs no ROS, and needs no network to the master."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

EXAMPLE = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
GATE = "hosts:\n  gate: {address: gate.uni.example, user: jdoe}\n"
BEHIND = EXAMPLE.replace("hosts:\n", GATE, 1).replace("k3-pi: {", "k3-pi: {via: gate, ", 1)


def swarm_of(text: str, folder: Path) -> tuple[Swarm | None, list[str]]:
    (folder / "swarm.yaml").write_text(text, "utf-8")
    swarm, found = load_swarm(folder / "swarm.yaml")
    return swarm, [one.code for one in found]


@pytest.mark.parametrize("mode", ["leader: koala-laptop\n", "hub: koala-laptop\n"])
def test_a_jump_host_outside_the_networks_runs_no_ros(mode: str, tmp_path: Path) -> None:
    text = BEHIND.replace("leader: koala-laptop\n", mode, 1)
    swarm, found = swarm_of(
        text if mode.startswith("leader") else text.replace("mode: leader", "mode: central"), tmp_path
    )
    assert found == []
    assert swarm is not None
    assert "gate" not in swarm.islands[0].hosts
    assert bundles(swarm)["gate"].files == ()


@pytest.mark.parametrize(
    "work",
    [
        "control:\n  - {by: gate, of: [koala]}\n",
        "programs:\n  watch: {host: gate, package: rosbag, executable: record}\n",
        "time: {root: gate}\n",
    ],
)
def test_a_jump_host_with_ros_work_needs_a_network(work: str, tmp_path: Path) -> None:
    text = BEHIND.replace("control:\n", work, 1) if work.startswith("control") else BEHIND + work
    assert "NET001" in swarm_of(text, tmp_path)[1]


def test_a_jump_host_on_the_swarms_network_runs_ros(tmp_path: Path) -> None:
    text = BEHIND.replace("gate.uni.example", "192.168.77.9").replace(
        "[koala-laptop,", "[gate, koala-laptop,", 1
    )
    swarm, found = swarm_of(text, tmp_path)
    assert found == []
    assert swarm is not None
    assert "gate" in swarm.islands[0].hosts


def test_in_mode_standalone_a_jump_host_is_no_island(tmp_path: Path) -> None:
    text = BEHIND.replace("mode: leader\nleader: koala-laptop\n", "mode: standalone\n", 1)
    swarm, found = swarm_of(text, tmp_path)
    assert swarm is not None, found
    assert [island.hub for island in swarm.islands] == ["koala-laptop", "k3-pi", "epuck-pi"]
    assert bundles(swarm)["gate"].files == ()


def test_a_jump_host_on_a_standalone_network_is_an_island(
    tmp_path: Path,
) -> None:
    text = EXAMPLE.replace("mode: leader\nleader: koala-laptop\n", "mode: standalone\n", 1)
    swarm, found = swarm_of(text.replace("k3-pi: {", "k3-pi: {via: epuck-pi, ", 1), tmp_path)
    assert swarm is not None, found
    assert [island.hub for island in swarm.islands] == ["koala-laptop", "k3-pi", "epuck-pi"]
