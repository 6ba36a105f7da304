"""IPv6: with ROS 1 all that starts ROS has ROS_IPV6=on, with ROS 2 nodes look for others at the addresses."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

import pytest
import yaml

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests.loading import load_swarm
from tests.render.dds_security.build import CYCLONE_DDS
from tests.render.dds_security.participant import NEEDED, UNSECURED, network, participant
from tests.render.rendered import text_of
from tests.render.test_filtered_hosts import listed
from tests.render.test_zenoh import closing, node_of, opened, router_of, sessions

SPEC = """\
version: 1
name: six
mode: central
hub: desk
ros: {ipv6: %s}
hosts:
  desk: {address: desk.lab}
  pi: {address: pi.lab}
robots:
  k3: {type: khepera3, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [desk, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
programs:
  see: {host: pi, container: {image: docker.io/library/see@sha256:%s, engine: podman}}
"""


@pytest.mark.parametrize("used", [True, False])
def test_everything_that_starts_ros_has_the_variable(used: bool, tmp_path: Path) -> None:
    (tmp_path / "six.yaml").write_text(SPEC % (str(used).lower(), "0" * 64))
    swarm, found = load_swarm(tmp_path / "six.yaml")
    assert swarm is not None, found
    made = {
        host: {one.path: one.content.decode() for one in bundles(swarm)[host].files} for host in swarm.hosts
    }
    for files in made.values():
        assert ("ROS_IPV6=on" in files["env/ros.env"].splitlines()) is used
        assert ("export ROS_IPV6=on" in files["setup.bash"].splitlines()) is used
    assert ("--env ROS_IPV6 " in made["pi"]["units/swarm-six.see.service"]) is used


def of_ros_2(folder: Path, ros: str) -> Mapping[str, Bundle]:
    spec = yaml.safe_load(SPEC % ("false", "0" * 64)) | {
        "ros": yaml.safe_load(f"{{{ros}}}"),
        "security": "filtered",
    }
    del spec["programs"]
    for number, host in enumerate(spec["hosts"].values()):
        host["address"] = f"fd00:77::1{number}"
    (folder / "six.yaml").write_text(yaml.safe_dump(spec))
    swarm, found = load_swarm(folder / "six.yaml")
    assert swarm is not None, found
    return bundles(swarm)


@pytest.mark.parametrize("distro", ["humble", "kilted"])
def test_fast_dds_finds_its_peers_by_udpv6(distro: str, tmp_path: Path) -> None:
    text = text_of(of_ros_2(tmp_path, f"distro: {distro}")["pi"], "env/fastdds.xml")
    assert "<type>UDPv6</type>" in text
    assert "<locator><udpv6/></locator>" in text  # of IPv4 it lets no node be found
    assert [f"<address>fd00:77::1{one}</address>" in text for one in (0, 1)] == [True, True]
    assert "interfaceWhiteList" not in text
    assert "ROS_STATIC_PEERS" not in text_of(of_ros_2(tmp_path, f"distro: {distro}")["pi"], "env/ros.env")


def test_nodes_look_for_a_discovery_server_of_ipv6(tmp_path: Path) -> None:
    made = of_ros_2(tmp_path, "distro: jazzy, discovery: server")
    assert 'ROS_DISCOVERY_SERVER="[fd00:77::10]:11811"' in text_of(made["pi"], "env/ros.env")
    assert "-l fd00:77::10 -p 11811" in text_of(made["desk"], "units/swarm-six.discovery.service")


@pytest.mark.parametrize(
    ("rmw", "group"), [("fastrtps", "ff1e::ffff:efff:1"), ("cyclonedds", "ff02::ffff:efff:1")]
)
def test_a_filtered_host_receives_from_the_group_of_ipv6(rmw: str, group: str, tmp_path: Path) -> None:
    made = of_ros_2(tmp_path, f"distro: jazzy, rmw: {rmw}, discovery: multicast")["pi"]
    assert listed(made)["k3"] == {"fd00:77::10", "fd00:77::11", group}
    assert f"ip6 daddr {{ fd00:77::10, {group}" in text_of(made, "firewall.nft")
    own = "fd00:77::11"  # Linux gives a host its own packets to a group back
    assert f"ip6 saddr {{ fd00:77::10, {own} }} accept" in text_of(made, "firewall.nft")


def test_a_node_finds_a_zenoh_router_of_ipv6(tmp_path: Path) -> None:
    made = of_ros_2(tmp_path, "distro: jazzy, rmw: zenoh")
    router, node = router_of(made["desk"], "six"), node_of(made["pi"])
    assert '["tcp/[fd00:77::10]:7447"]' in router
    own = [one.replace("fd00:77::10", "::1") for one in (router, node)]
    with sessions(own[0]), closing(opened(own[1])) as session:
        assert len(session.info.routers_zid()) == 1


@NEEDED
def test_cyclone_dds_exchanges_messages_over_ipv6(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = of_ros_2(tmp_path, "distro: jazzy, rmw: cyclonedds")
    with network() as name, ExitStack() as stack:
        for host, number, end in (("desk", 0, "pub t"), ("pi", 1, "sub t")):
            add = ["addr", "add", f"fd00:77::1{number}/128", "dev", "lo", "nodad"]
            subprocess.run(["ip", "-n", name, *add], check=True)
            file = tmp_path / f"{host}.xml"
            file.write_text(text_of(made[host], "env/cyclonedds.xml"))
            monkeypatch.setenv("CYCLONEDDS_URI", f"file://{file}")
            last = stack.enter_context(participant(CYCLONE_DDS, name, tmp_path, UNSECURED, end))
        last.receives("t")
