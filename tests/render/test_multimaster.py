"""Several masters: each hub gets exactly what it needs to receive the declared topics, and nothing else."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.render.ros1.multimaster.fkie import FAMILIES
from tests import ROOT
from tests.loading import load_swarm

GOLDEN = Path(__file__).parent / "golden"
MODES = ROOT / "tests/mode_conversion/modes"
PARAMS = "params/multimaster.yaml"
UNIT = "swarm-newswarm.multimaster.service"


def rendered(tmp_path: Path, mode: str, more: str = "") -> Mapping[str, Bundle]:
    text = (MODES / f"{mode}.yaml").read_text("utf-8").replace("multimaster: {provider: fkie}\n", "")
    spec = tmp_path / "swarm.yaml"
    spec.write_text(text + (more or "multimaster: {provider: fkie}\n"), "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)


def texts(bundle: Bundle) -> Mapping[str, str]:
    return {file.path: file.content.decode() for file in bundle.files if "multimaster" in file.path}


def params(bundle: Bundle) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(texts(bundle)[PARAMS])
    return data


CROSSING = """
multimaster:
  packages: {packages}
  topics:
    - {{topic: /k3/odom, to: [koala-laptop, epuck-pi]}}
    - {{topic: /epuck/odom, to: [koala-laptop]}}
"""


@pytest.mark.parametrize("family", FAMILIES)
def test_golden(family: str, tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    for host, bundle in rendered(tmp_path, "standalone", CROSSING.format(packages=family)).items():
        for path, text in texts(bundle).items():
            if not path.startswith("units/"):  # the same for all of them
                golden(GOLDEN / "multimaster" / family / host / path, text)


def test_golden_combined(tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    made = rendered(tmp_path, "combined")
    assert not texts(made["k3-pi"]), "a host that is no hub joins nothing"
    for host in ("koala-laptop", "epuck-pi"):
        for path, text in texts(made[host]).items():
            golden(GOLDEN / "multimaster" / "combined" / host / path, text)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_hub_receives_each_topic_from_its_own_master_only(family: str, tmp_path: Path) -> None:
    made = rendered(tmp_path, "standalone", CROSSING.format(packages=family))
    sync = params(made["koala-laptop"])[FAMILIES[family].sync.name]

    assert sync["sync_topics"] == [{"k3-pi": ["/k3/odom"]}, {"epuck-pi": ["/epuck/odom"]}]
    assert sync["sync_hosts"] == ["k3-pi", "epuck-pi"]
    assert sync["ignore_subscribers"] == sync["ignore_services"] == ["*"]
    assert "ignore_hosts" not in sync


def test_a_hub_that_receives_nothing_runs_no_sync(tmp_path: Path) -> None:
    """Without a list of topics, fkie's sync accepts all of them."""
    made = rendered(tmp_path, "standalone", CROSSING.format(packages="fkie_multimaster"))

    assert list(params(made["k3-pi"])) == ["master_discovery"]
    assert "master_sync" not in texts(made["k3-pi"])["launch/multimaster.launch"]
    assert "package:fkie_master_sync" not in made["k3-pi"].requires
    assert "package:fkie_master_sync" in made["epuck-pi"].requires


@pytest.mark.parametrize("family", FAMILIES)
def test_the_launch_file_starts_the_nodes_of_the_parameters(family: str, tmp_path: Path) -> None:
    bundle = rendered(tmp_path, "standalone", CROSSING.format(packages=family))["epuck-pi"]
    launch = ET.fromstring(texts(bundle)["launch/multimaster.launch"])
    nodes = {node.get("name"): node.get("pkg") for node in launch.iter("node")}

    assert nodes.keys() == params(bundle).keys()
    assert {f"package:{name}" for name in nodes.values()} <= set(bundle.requires)


def test_nodes_of_an_islands_other_hosts_cross_too(tmp_path: Path) -> None:
    assert params(rendered(tmp_path, "combined")["epuck-pi"])["master_sync"]["sync_remote_nodes"] is True


def test_the_peer_list_is_everybody_or_that_of_the_spec(tmp_path: Path) -> None:
    everybody = rendered(tmp_path, "standalone")
    limited = rendered(tmp_path, "standalone", "multimaster: {robot_hosts: {k3-pi: [epuck-pi]}}\n")

    assert params(everybody["k3-pi"])["master_discovery"]["robot_hosts"] == ["192.168.77.10", "192.168.77.12"]
    assert params(limited["k3-pi"])["master_discovery"]["robot_hosts"] == ["192.168.77.12"]


def test_no_multicast_is_tried_where_none_passes(tmp_path: Path) -> None:
    text = (MODES / "standalone.yaml").read_text("utf-8").replace("multicast: true", "multicast: false")
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    discovery = params(bundles(swarm)["k3-pi"])["master_discovery"]

    assert (discovery["send_mcast"], discovery["listen_mcast"]) == (False, False)


def test_one_island_needs_no_multimaster(tmp_path: Path) -> None:
    assert not any(texts(bundle) for bundle in rendered(tmp_path, "leader", "\n").values())


def test_the_unit_waits_for_its_master_and_needs_its_files(tmp_path: Path) -> None:
    bundle = rendered(tmp_path, "standalone")["k3-pi"]
    unit = next(one for one in bundle.units if one.name == UNIT)

    assert {PARAMS, "launch/multimaster.launch", "env/ros.env"} <= set(unit.needs)
    assert "bin/ros-client --forever roslaunch --wait " in texts(bundle)[f"units/{UNIT}"]
