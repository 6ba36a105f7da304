"""The WireGuard of a sealed swarm: peers are those of the flows, each with one address."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path

import pytest
from swarm_onboard.tunnel.keys import Keys
from swarm_onboard.tunnel.peers import PEERS

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


def sealed(folder: Path, example: str, *pinned: str, more: str = "") -> Swarm:
    spec = folder / "swarm.yaml"
    text = (ROOT / "examples" / example / "swarm.yaml").read_text("utf-8")
    spec.write_text(f"{text}security: sealed\n", "utf-8")
    keys = "".join(f"{one} {key_of(one)}\n" for one in pinned)
    (folder / "newswarm.wireguard").write_text(keys + more, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return swarm


def peers_in(bundle: Bundle) -> Mapping[str, tuple[list[str], str]]:
    """By name, the addresses and the endpoint of each peer."""
    found = json.loads(text_of(bundle, PEERS))
    assert found["port"] == 51820
    return {one["name"]: (one["addresses"], one["endpoint"]) for one in found["peers"]}


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
            one: ([swarm.hosts[one].ros_address], swarm.hosts[one].address) for one in swarm.peers[host]
        }
        assert peers_in(made[host]) == expected
        assert expected
        assert made[host].unpinned == ()
        assert made[host].requires["wg"] == ("security",)


def test_a_host_that_joins_restarts_no_wireguard(tmp_path: Path) -> None:
    made = bundles(sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi", "epuck-pi"))["koala-laptop"]
    (unit,) = (one for one in made.units if one.name == "swarm-newswarm.wireguard.service")
    assert not {PEERS} & set(unit.needs)


def test_keys_are_no_part_of_a_release(tmp_path: Path) -> None:
    """A rollback brings back none, and a new key changes no release."""
    before = bundles(sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi"))["k3-pi"]
    after = bundles(sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi", "epuck-pi"))["k3-pi"]
    assert before.digest == after.digest
    assert (before.unpinned, after.unpinned) == (("epuck-pi",), ())
    known = {host: (key_of(host),) for host in ("koala-laptop", "k3-pi", "epuck-pi")}
    assert Keys(after.wireguard_keys).live == known


def test_an_expelled_host_needs_no_key(tmp_path: Path) -> None:
    retired = f"epuck-pi {key_of('epuck-pi')} retired\nother-pi {key_of('other-pi')} retired\n"
    swarm = sealed(tmp_path, "paper-leader", "koala-laptop", "k3-pi", more=retired)
    bundle = bundles(swarm)["k3-pi"]
    assert (swarm.keys.expelled, bundle.unpinned) == ({"epuck-pi", "other-pi"}, ())
    assert Keys(bundle.wireguard_keys).retired == {
        host: (key_of(host),) for host in ("epuck-pi", "other-pi")
    }, "whatever release comes back has them retired"


def test_masters_look_for_no_others_by_multicast(tmp_path: Path) -> None:
    example = ROOT / "examples/paper-4-standalone"
    (tmp_path / "more.yaml").write_text("security: sealed\nmultimaster: {provider: fkie}\n", "utf-8")
    swarm, found = load_swarm(example / "swarm.yaml", tmp_path / "more.yaml")
    assert swarm is not None, found
    text = text_of(bundles(swarm)["k3-pi"], "params/multimaster.yaml")
    assert "send_mcast: false" in text
    assert swarm.hosts["koala-laptop"].ros_address in text
