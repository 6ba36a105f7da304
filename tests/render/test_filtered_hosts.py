"""What hosts of filtered islands get: IP lists of their units, with declared peers only, and a firewall."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests import ROOT
from tests.loading import load_swarm

LAPTOP, K3, EPUCK = "192.168.77.10", "192.168.77.11", "192.168.77.12"
GOLDEN = ROOT / "tests/render/golden/filtered"
EVERYBODY = {LAPTOP, K3, EPUCK}
OWN_PROGRAM = "programs: {own: {host: k3-pi, command: [/bin/true]}}\n"


def rendered(folder: Path, security: str, *names: str, more: str = "") -> dict[str, Bundle]:
    layers = [ROOT / "examples" / name for name in names]
    overlay = folder / f"{security}.yaml"
    overlay.write_text(f"security: {security}\n{more}", "utf-8")
    swarm, found = load_swarm(*layers, overlay)
    assert swarm is not None, found
    return dict(bundles(swarm))


def listed(bundle: Bundle) -> dict[str, set[str]]:
    """The addresses in the list of each unit that has one."""
    texts = {file.path: file.content.decode() for file in bundle.files if file.path.startswith("units/")}
    found = {}
    for path, text in texts.items():
        if "IPAddressAllow=" in text:
            assert "IPAddressDeny=any" in text
            assert "IPAccounting=yes" in text
            lines = text.splitlines()
            addresses = {line.partition("=")[2] for line in lines if line.startswith("IPAddressAllow=")}
            found[path.split(".", 1)[1].removesuffix(".service")] = addresses - {"localhost"}
    return found


def test_units_exchange_packets_with_the_hosts_of_their_island(tmp_path: Path) -> None:
    found = rendered(tmp_path, "filtered", "paper-leader/swarm.yaml", more=OWN_PROGRAM)
    assert listed(found["koala-laptop"]) == {"master": EVERYBODY, "koala": EVERYBODY}
    assert listed(found["k3-pi"]) == {"k3": EVERYBODY}  # what a program of one's own needs is not known


@pytest.mark.parametrize("provider", ["static", "fkie"])
def test_units_of_other_islands_only_where_topics_cross(provider: str, tmp_path: Path) -> None:
    """Multimasters that discover each other by multicast need all hubs, and the group."""
    more = f"multimaster: {{provider: {provider}}}\n"
    found = rendered(tmp_path, "filtered", "paper-4-standalone/swarm.yaml", more=more)
    others, group = ({EPUCK}, {"226.0.0.0"}) if provider == "fkie" else (set(), set())
    assert set(map(frozenset, listed(found["k3-pi"]).values())) == {frozenset({K3, LAPTOP} | others | group)}
    assert set(map(frozenset, listed(found["koala-laptop"]).values())) == {frozenset(EVERYBODY | group)}


def test_ros_2_nodes_that_discover_by_multicast_need_its_group(tmp_path: Path) -> None:
    spec = tmp_path / "multicast.yaml"
    text = (ROOT / "examples/ros2-2-leader/swarm.yaml").read_text("utf-8")
    spec.write_text(text.replace("multicast: false", "multicast: true"), "utf-8")
    found = rendered(tmp_path, "filtered", str(spec), more="ros: {discovery: multicast}\n")
    assert all("239.255.0.1" in one for bundle in found.values() for one in listed(bundle).values())


def test_an_island_can_be_filtered_alone(tmp_path: Path) -> None:
    more = "islands: {lone-epuck: {security: filtered}}\n"
    found = rendered(tmp_path, "off", "paper-5-combined/swarm.yaml", more=more)
    assert {host: listed(bundle) for host, bundle in found.items() if listed(bundle)} == {
        "epuck-pi": {"master": {EPUCK}, "epuck": {EPUCK}}
    }


def test_a_change_of_the_list_restarts_nothing(tmp_path: Path) -> None:
    """systemd applies it at the daemon-reload of a deploy: a robot that joins stops no other one."""
    off, filtered = (rendered(tmp_path, one, "paper-leader/swarm.yaml") for one in ("off", "filtered"))
    assert not any(map(listed, off.values()))
    for host, bundle in filtered.items():
        assert bundle.digest != off[host].digest
        units = {one["name"]: one for one in bundle.manifest["units"]}
        assert units.pop("swarm-newswarm.firewall.service")
        assert list(units.values()) == off[host].manifest["units"]


def test_golden_firewall(tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    """A hub and a robot's host; another example has islands that a topic joins, and ROS 2."""
    for example, more, host in (
        ("paper-leader", "", "koala-laptop"),
        ("paper-4-standalone", "multimaster: {provider: fkie}\n", "k3-pi"),
        ("ros2-2-leader", "", "koala-laptop"),
    ):
        bundle = rendered(tmp_path, "filtered", f"{example}/swarm.yaml", more=more)[host]
        for file in bundle.files:
            if file.path.endswith(("firewall.nft", "firewall.service")):
                golden(GOLDEN / example / host / file.path, file.content.decode())


def test_a_host_without_a_firewall_needs_no_nft(tmp_path: Path) -> None:
    more = "islands: {lone-epuck: {security: filtered}}\n"
    found = rendered(tmp_path, "off", "paper-5-combined/swarm.yaml", more=more)
    assert {host for host, bundle in found.items() if "nft" in bundle.requires} == {"epuck-pi"}
