"""The addresses of WireGuard follow from the names of swarm and host, and from nothing else."""

from __future__ import annotations

from ipaddress import IPv4Network
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from swarmctl.spec.model import Spec
from swarmctl.swarm.addresses import wireguard_address, wireguard_network
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

NAMES = st.from_regex(r"[a-z][a-z0-9-]{0,30}", fullmatch=True)
EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"


def spec(swarm: str, *hosts: str, overlay: str | None = None) -> Spec:
    return Spec.model_validate(
        {
            "version": 1, "name": swarm, "mode": "standalone", "security": "sealed", "overlay": overlay,
            "hosts": {one: {"address": "192.168.77.1"} for one in hosts},
            "robots": {"k3": {"type": "khepera3", "host": hosts[0]}},
        }
    )  # fmt: skip


@given(swarm=NAMES, hosts=st.lists(NAMES, min_size=1, max_size=5, unique=True), bits=st.integers(8, 20))
def test_no_other_host_changes_an_address(swarm: str, hosts: list[str], bits: int) -> None:
    chosen = str(IPv4Network(f"10.0.0.0/{bits}"))
    for overlay in (None, chosen):
        every = spec(swarm, *hosts, overlay=overlay)
        network = wireguard_network(every)
        assert network == IPv4Network(overlay) if overlay else network.prefixlen == 16
        for host in hosts:
            found = wireguard_address(every, host)
            assert found == wireguard_address(spec(swarm, host, overlay=overlay), host)
            assert found in network
            assert found not in (network.network_address, network.broadcast_address)


def resolved(tmp_path: Path, *more: str) -> Swarm:
    path = tmp_path / "swarm.yaml"
    path.write_text("\n".join((EXAMPLE.read_text("utf-8"), *more)), "utf-8")
    swarm, found = load_swarm(path)
    assert swarm is not None, found
    return swarm


def test_ros_uses_wireguard_and_ssh_does_not(tmp_path: Path) -> None:
    swarm = resolved(tmp_path, "security: sealed")
    (island,) = swarm.islands
    hosts = swarm.hosts.values()
    assert all(one.address.startswith("192.168.77.") for one in hosts)
    assert {one.ros_address.split(".")[0] for one in hosts} == {"10"}
    assert swarm.master_uri(island) == f"http://{swarm.hosts[island.hub].ros_address}:11311"
    assert {one.advertised for one in hosts} == {one.ros_address for one in hosts}


def test_a_jump_host_keeps_its_address(tmp_path: Path) -> None:
    """It runs no ROS, and no WireGuard."""
    text = EXAMPLE.read_text("utf-8").replace("hosts:\n", "hosts:\n  gate: {address: 192.168.77.9}\n", 1)
    path = tmp_path / "swarm.yaml"
    text = text.replace("k3-pi: {address: 192.168.77.11,", "k3-pi: {address: 192.168.77.11, via: gate,")
    path.write_text(f"{text}\nsecurity: sealed\n", "utf-8")
    swarm, found = load_swarm(path)
    assert swarm is not None, found
    assert swarm.hosts["k3-pi"].via == "gate"
    assert swarm.hosts["gate"].ros_address == "192.168.77.9"


def test_names_stay_what_uris_contain(tmp_path: Path) -> None:
    text = EXAMPLE.read_text("utf-8")
    naming = "ros: {distro: noetic, naming: hosts}"
    assert "\nros:" not in text
    swarm = resolved(tmp_path, "security: sealed", naming)
    assert [one.advertised for one in swarm.hosts.values()] == list(swarm.hosts)


def test_only_a_sealed_swarm_has_other_addresses(tmp_path: Path) -> None:
    swarm = resolved(tmp_path, "security: filtered")
    assert swarm.overlay == ""
    assert all(one.ros_address == one.address for one in swarm.hosts.values())
