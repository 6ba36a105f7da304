"""`ros.naming`: what stands for a host in its nodes' URIs is one text, in all that is generated."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
import yaml

from swarmctl.health.expected_graph import Release, expected_graph
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.spec.model import Mode
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

GOLDEN = Path(__file__).parent / "golden/naming-hosts"
MODES = ROOT / "tests/mode_conversion/modes"
SHOWN = ("env/ros.env", "hosts/block", "params/multimaster.yaml")
everywhere = pytest.mark.parametrize("mode", [mode.value for mode in Mode])
both = pytest.mark.parametrize("naming", ["address", "hosts"])


def swarm_in(folder: Path, mode: str, naming: str, provider: str = "fkie") -> Swarm:
    text = (MODES / f"{mode}.yaml").read_text("utf-8").replace("multimaster: {provider: fkie}\n", "")
    text += f"\nros: {{naming: {naming}}}\n"
    if mode in ("standalone", "combined"):
        crossing = ", topics: [{topic: /k3/odom, to: [koala-laptop]}]" if mode == "standalone" else ""
        text += f"multimaster: {{provider: {provider}{crossing}}}\n"
    spec = folder / "swarm.yaml"
    spec.write_text(text, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return swarm


def text_of(bundle: Bundle, path: str) -> str:
    return next((file.content.decode() for file in bundle.files if file.path == path), "")


def parameters(bundle: Bundle, name: str) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(text_of(bundle, f"params/{name}.yaml")) or {}
    return data


def environment(bundle: Bundle) -> Mapping[str, str]:
    lines = text_of(bundle, "env/ros.env").splitlines()
    return {key: value.strip('"') for key, _, value in (line.partition("=") for line in lines) if value}


@pytest.mark.parametrize("mode", ["leader", "standalone"])
def test_golden(mode: str, tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    for host, bundle in bundles(swarm_in(tmp_path, mode, "hosts")).items():
        for file in bundle.files:
            if file.path in SHOWN:
                golden(GOLDEN / mode / host / file.path, file.content.decode())


@everywhere
@both
def test_nodes_masters_and_the_authority_use_one_text(mode: str, naming: str, tmp_path: Path) -> None:
    swarm = swarm_in(tmp_path, mode, naming)
    made = {name: bundle for name, bundle in bundles(swarm).items() if environment(bundle)}
    key = "ROS_HOSTNAME" if naming == "hosts" else "ROS_IP"
    texts = {name: environment(bundle)[key] for name, bundle in made.items()}
    assert texts == {name: name if naming == "hosts" else swarm.hosts[name].address for name in made}
    for name, bundle in made.items():
        island = swarm.island_of(name)
        assert urlsplit(environment(bundle)["ROS_MASTER_URI"]).hostname == texts[island.hub]
        assert f"export {key}={texts[name]}\n" in text_of(bundle, "setup.bash")
        for robot in swarm.robots_on(name):
            commanders = parameters(bundle, robot.name)["commanders"]
            assert {one for commander in commanders for one in commander["addresses"]} <= set(texts.values())
    if mode in ("leader", "single-minded"):
        [robot, *_] = swarm.robots.values()
        assert robot.commanders[0].addresses == (texts[swarm.islands[0].hub],)
    graph = expected_graph(swarm, {name: Release(one.digest, ()) for name, one in made.items()})
    assert {one.name: one.advertised for one in graph.hosts} == texts
    assert {one.name: graph.homes[texts[one.name]] for one in graph.hosts} == {
        name: swarm.island_of(name).name for name in made
    }


@pytest.mark.parametrize("mode", ["standalone", "combined"])
@both
def test_peers_address_each_other_by_that_text(mode: str, naming: str, tmp_path: Path) -> None:
    swarm = swarm_in(tmp_path, mode, naming, provider="static")
    islands = {island.name: island for island in swarm.islands}
    parameters_by_host = {name: parameters(bundle, "multimaster") for name, bundle in bundles(swarm).items()}
    assert any(parameters_by_host.values())
    for name, params in parameters_by_host.items():
        if not params:
            continue
        assert params["address"] == swarm.hosts[name].advertised
        for peer in params["peers"]:
            island = islands[peer["island"]]
            assert urlsplit(peer["master"]).hostname == swarm.hosts[island.hub].advertised
            assert {swarm.hosts[host].advertised for host in island.hosts} <= set(peer["hosts"])


@both
def test_fkie_sends_from_the_hosts_address(naming: str, tmp_path: Path) -> None:
    swarm = swarm_in(tmp_path, "standalone", naming)
    for name, bundle in bundles(swarm).items():
        [discovery, *_] = parameters(bundle, "multimaster").values()
        assert discovery.get("interface") == (swarm.hosts[name].address if naming == "hosts" else None)


def test_a_master_waits_for_its_address(tmp_path: Path) -> None:
    """By Debian's line it means 127.0.1.1, where one can listen before the network is there."""
    swarm = swarm_in(tmp_path, "leader", "hosts")
    [island] = swarm.islands
    unit = text_of(bundles(swarm)[island.hub], f"units/swarm-{swarm.name}.master.service")
    assert f"wait-for-address {swarm.hosts[island.hub].address} " in unit
    assert f"wait-for-master http://{island.hub}:" in unit
