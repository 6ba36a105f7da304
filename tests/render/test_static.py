"""Provider `static`: each hub that receives topics gets the node, with its own peers only."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from swarm_onboard.multimaster import config

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests import ROOT
from tests.loading import load_swarm
from tests.render.rendered import text_of

GOLDEN = Path(__file__).parent / "golden/static"
MODES = ROOT / "tests/mode_conversion/modes"
PARAMS = "params/multimaster.yaml"
UNIT = "swarm-newswarm.multimaster.service"
CROSSING = """
multimaster:
  provider: static
  topics:
    - {topic: /k3/odom, to: [koala-laptop, epuck-pi]}
    - {topic: /koala/odom, to: [epuck-pi]}
    - {topic: /epuck/odom, to: [koala-laptop]}
"""


def rendered(tmp_path: Path, mode: str, more: str = CROSSING) -> Mapping[str, Bundle]:
    text = (MODES / f"{mode}.yaml").read_text("utf-8").replace("multimaster: {provider: fkie}\n", "")
    spec = tmp_path / "swarm.yaml"
    spec.write_text(text + more, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)


def params(bundle: Bundle) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(text_of(bundle, PARAMS))
    return data


@pytest.mark.parametrize("mode", ["standalone", "combined"])
def test_golden(mode: str, tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    crossing = "multimaster: {provider: static}\n" if mode == "combined" else CROSSING
    for host, bundle in rendered(tmp_path, mode, crossing).items():
        for file in bundle.files:
            if "multimaster" in file.path and not file.path.startswith("multimaster/"):
                golden(GOLDEN / mode / host / file.path, file.content.decode())


def test_a_hub_that_receives_nothing_runs_nothing(tmp_path: Path) -> None:
    made = rendered(tmp_path, "standalone")
    for host, joins in {"koala-laptop": True, "k3-pi": False, "epuck-pi": True}.items():
        assert (UNIT in [unit.name for unit in made[host].units]) == joins
        assert any(file.path.startswith("multimaster/") for file in made[host].files) == joins
        assert (PARAMS in [file.path for file in made[host].files]) == joins


def test_the_node_understands_its_parameters(tmp_path: Path) -> None:
    for bundle in rendered(tmp_path, "standalone").values():
        if any(file.path == PARAMS for file in bundle.files):
            parsed = config.parse(params(bundle))
            assert {peer.island: dict(peer.receives) for peer in parsed.peers} == {
                peer["island"]: {one["topic"]: one["type"] for one in peer["receives"]}
                for peer in params(bundle)["peers"]
            }


def test_the_parameters_list_incoming_and_outgoing_topics(tmp_path: Path) -> None:
    [k3, epuck] = params(rendered(tmp_path, "standalone")["koala-laptop"])["peers"]
    assert [one["topic"] for one in k3["receives"]] == ["/k3/odom"]
    assert k3["sends"] == []
    assert {"topic": "/koala/odom", "type": "nav_msgs/Odometry"} in epuck["sends"]


def test_nodes_of_an_islands_other_hosts_cross_too(tmp_path: Path) -> None:
    made = rendered(tmp_path, "combined", "multimaster: {provider: static}\n")
    [peer] = params(made["epuck-pi"])["peers"]
    assert peer["hosts"] == ["192.168.77.10", "koala-laptop", "192.168.77.11", "k3-pi"]
    assert UNIT not in [unit.name for unit in made["k3-pi"].units]


def test_the_unit_needs_its_node_and_parameters_but_no_driver(
    tmp_path: Path,
) -> None:
    bundle = rendered(tmp_path, "standalone")["koala-laptop"]
    unit = next(one for one in bundle.units if one.name == UNIT)
    paths = {file.path for file in bundle.files}
    assert (
        {PARAMS, "multimaster/static_multimaster.py", "multimaster/swarm_onboard/multimaster/bridge.py"}
        <= set(unit.needs)
        <= paths
    )
    assert "drivers/swarm_onboard/driver/driver.py" not in unit.needs


def test_the_node_comes_with_all_that_it_imports(tmp_path: Path) -> None:
    """Also to a hub that drives no robot, and so has no drivers."""
    spec = (MODES / "standalone.yaml").read_text("utf-8").replace("multimaster: {provider: fkie}\n", "")
    desk = "hosts:\n  desk: {address: 192.168.77.20, computer: laptop}\n"
    (tmp_path / "swarm.yaml").write_text(
        spec.replace("hosts:\n", desk, 1).replace("hosts: [", "hosts: [desk, ", 1)
        + "multimaster: {provider: static, topics: [{topic: /k3/odom, to: [desk]}]}\n",
        "utf-8",
    )
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    paths = {file.path for file in bundles(swarm)["desk"].files}
    assert {
        "multimaster/swarm_onboard/common/__init__.py",
        "multimaster/swarm_onboard/common/systemd.py",
    } <= paths
    assert "drivers/serial_driver.py" not in paths
