"""The WireGuard of a sealed swarm: peers are those of the flows, each with one address."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm
from tests.render.rendered import text_of

GOLDEN = ROOT / "tests/render/golden/wireguard"
OF_WIREGUARD = re.compile(r"wireguard/|units/.*\.wireguard\.service|firewall\.nft|env/ros\.env|hosts/")


def key_of(host: str) -> str:
    return base64.b64encode(sha256(host.encode()).digest()).decode()


def sealed(folder: Path, example: str, *pinned: str) -> Swarm:
    spec = folder / "swarm.yaml"
    text = (ROOT / "examples" / example / "swarm.yaml").read_text("utf-8")
    spec.write_text(f"{text}security: sealed\n", "utf-8")
    (folder / "newswarm.wireguard").write_text("".join(f"{one} {key_of(one)}\n" for one in pinned), "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return swarm


def peers_in(bundle: Bundle) -> Mapping[str, tuple[str, str]]:
    """By public key, the one address and the endpoint of each peer."""
    text = text_of(bundle, "wireguard/peers.conf")
    found = re.findall(r"PublicKey = (\S+)\nAllowedIPs = (\S+)\nEndpoint = (\S+)\n", text)
    return {key: (allowed, endpoint) for key, allowed, endpoint in found}


def test_golden(tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    swarm = sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi", "epuck-pi")
    for file in bundles(swarm)["k3-pi"].files:
        if OF_WIREGUARD.match(file.path):
            golden(GOLDEN / file.path, file.content.decode())


@pytest.mark.parametrize("example", ["paper-leader", "paper-4-standalone", "ros2-4-standalone"])
def test_peers_are_those_of_the_flows(example: str, tmp_path: Path) -> None:
    hosts = ("koala-laptop", "k3-pi", "epuck-pi")
    swarm = sealed(tmp_path, example, *hosts)
    made = bundles(swarm)
    for host in hosts:
        expected = {
            key_of(one): (f"{swarm.hosts[one].ros_address}/32", f"{swarm.hosts[one].address}:51820")
            for one in swarm.peers[host]
        }
        assert peers_in(made[host]) == expected
        assert expected
        assert made[host].unpinned == ()
        assert made[host].requires["wg"] == ("security",)


def test_a_host_that_joins_restarts_no_wireguard(tmp_path: Path) -> None:
    before = bundles(sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi"))["koala-laptop"]
    after = bundles(sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi", "epuck-pi"))["koala-laptop"]
    assert peers_in(before) != peers_in(after)
    units = [{one["name"]: one for one in made.manifest["units"]} for made in (before, after)]
    assert units[0] == units[1]


def test_a_host_without_a_pinned_key_is_no_peer(tmp_path: Path) -> None:
    bundle = bundles(sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi"))["k3-pi"]
    assert set(peers_in(bundle)) == {key_of("koala-laptop")}
    assert bundle.unpinned == ("epuck-pi",)


def test_masters_look_for_no_others_by_multicast(tmp_path: Path) -> None:
    example = ROOT / "examples/paper-4-standalone"
    (tmp_path / "more.yaml").write_text("security: sealed\nmultimaster: {provider: fkie}\n", "utf-8")
    swarm, found = load_swarm(example / "swarm.yaml", tmp_path / "more.yaml")
    assert swarm is not None, found
    text = text_of(bundles(swarm)["k3-pi"], "params/multimaster.yaml")
    assert "send_mcast: false" in text
    assert swarm.hosts["koala-laptop"].ros_address in text
