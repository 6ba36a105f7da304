"""From a swarm to a lab, as values: who has which address on which interface, and what no lab can be."""

from __future__ import annotations

import ipaddress
import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.lab.errors import LabError
from swarmctl.lab.lab_plan import Interface, LabNetwork, LabPlan, LabRobot, plan_of
from swarmctl.lab.lab_state import State, read_state, write_state
from swarmctl.lab.paths import LabPaths
from swarmctl.spec.model import Mode
from swarmctl.swarm.resolved import Host, Network, Swarm
from tests.lab.lab_values import plan_from


def swarm_of(addresses: dict[str, str], *networks: Network) -> Swarm:
    hosts = {
        name: Host(name, address, ros_address=address, advertised=address, optional=False)
        for name, address in addresses.items()
    }
    return Swarm("s", Mode.LEADER, "noetic", None, hosts, {}, networks, ())


def wlan(name: str, *hosts: str, subnet: str | None = None) -> Network:
    return Network(name, "wlan", hosts, subnet, None)


def test_hosts_have_the_addresses_of_the_spec(tmp_path: Path) -> None:
    alpha, beta = plan_from(tmp_path).hosts
    assert (alpha.address, alpha.user, alpha.port) == ("10.91.1.1", "robot", 22)
    assert (beta.address, beta.user, beta.port) == ("10.91.1.2", "root", 2222)


def test_a_lab_has_the_engines_and_the_ros_of_its_spec(tmp_path: Path) -> None:
    look = 'programs: {look: {host: alpha, container: {image: "sha256:' + "1" * 64 + '"}}}\nlinks:'
    plan = plan_from(tmp_path, ("links:", look))
    assert plan.engines == ("podman",)
    assert LabPlan.from_json(json.loads(json.dumps(plan.to_json()))) == plan
    assert (plan_from(tmp_path).engines, plan_from(tmp_path).distros) == ((), ("noetic",))


def test_interfaces_are_numbered_by_kind_in_the_order_of_the_links(tmp_path: Path) -> None:
    alpha, beta = plan_from(tmp_path).hosts
    assert alpha.interfaces == (
        Interface("wlan0", "air", "10.91.1.1/24"),
        Interface("eth0", "wire", "10.91.2.253/24"),
    )
    assert beta.interfaces[1] == Interface("eth0", "wire", "10.91.2.252/24")


def test_the_operator_has_the_last_free_address_of_every_network(tmp_path: Path) -> None:
    assert plan_from(tmp_path).networks == (
        LabNetwork("air", "wlan", "10.91.1.0/24", "10.91.1.254/24", multicast=False),
        LabNetwork("wire", "ethernet", "10.91.2.0/24", "10.91.2.254/24", multicast=True),
    )
    moved = plan_from(tmp_path, ("10.91.1.2,", "10.91.1.254,"))
    assert moved.networks[0].operator == "10.91.1.253/24"


def test_robots_have_the_devices_of_their_links(tmp_path: Path) -> None:
    plan = plan_from(tmp_path)
    assert plan.robots == (
        LabRobot("rover", "khepera3", "alpha", "/dev/swarm/rover", bluetooth=False, emulator="khepera3"),
        LabRobot("puck", "epuck", "beta", "/dev/rfcomm0", bluetooth=True, emulator="epuck"),
    )
    assert [robot.name for robot in plan.robots_on("beta")] == ["puck"]


def test_a_lab_has_the_name_of_its_swarm_by_default(tmp_path: Path) -> None:
    assert plan_from(tmp_path).name == "tiny"
    other = plan_from(tmp_path, name="other")
    assert (other.name, other.swarm) == ("other", "tiny")


def test_hosts_without_a_network_get_an_uplink_per_subnet() -> None:
    plan = plan_of(swarm_of({"a": "10.0.1.1", "b": "10.0.2.1", "c": "10.0.1.2"}))
    assert [(one.name, one.subnet) for one in plan.networks] == [
        ("uplink", "10.0.1.0/24"),
        ("uplink1", "10.0.2.0/24"),
    ]
    assert plan.host("c").interfaces == (Interface("eth0", "uplink", "10.0.1.2/24"),)


def test_hosts_known_by_a_name_get_a_free_address_of_their_network() -> None:
    given = {"a": "10.0.1.1", "b": "b.local", "c": "c.local", "d": "d.local", "e": "e.local"}
    plan = plan_of(swarm_of(given, wlan("air", "a", "b", "c"), wlan("far", "d", "e")))
    assert [host.address for host in plan.hosts] == [
        "10.0.1.1", "10.0.1.254", "10.0.1.253", "10.88.0.254", "10.88.0.253",
    ]  # fmt: skip
    assert [one.operator for one in plan.networks] == ["10.0.1.252/24", "10.88.0.252/24"]
    assert dict(plan.aliases)["c.local"] == "10.0.1.253"
    assert "a" not in dict(plan.aliases).values()


def test_ipv6() -> None:
    plan = plan_of(swarm_of({"a": "fd00::1", "b": "fd00::2"}, wlan("air", "a", "b", subnet="fd00::/64")))
    assert plan.host("a").interfaces == (Interface("wlan0", "air", "fd00::1/64"),)
    assert plan.networks[0].operator == "fd00::ffff:ffff:ffff:fffe/64"
    named = replace(swarm_of({"a": "a.lab"}, wlan("air", "a")), ipv6=True)
    assert plan_of(named).aliases == (("a.lab", "fd00:88::ffff:ffff:ffff:fffe"),)


@pytest.mark.parametrize(
    ("swarm", "message", "fix"),
    [
        (swarm_of({"a": "10.0.0.1", "b": "10.0.0.1"}), "hosts a and b both have the address", "its own"),
        (
            swarm_of(
                {"a": "10.0.0.1", "b": "10.0.0.2"},
                wlan("x", "a", "b", subnet="10.0.0.0/24"),
                wlan("y", "a", "b", subnet="10.0.0.128/25"),
            ),
            "networks x (10.0.0.0/24) and y (10.0.0.128/25) overlap",
            "use a separate `subnet` for each link",
        ),
        (
            swarm_of({"a": "10.0.0.1", "b": "10.0.0.2"}, wlan("x", "a", "b", subnet="10.0.0.0/30")),
            "the subnet 10.0.0.0/30 has no free address for swarmctl",
            "a larger subnet",
        ),
        (
            swarm_of({"a": "10.0.0.1", "b": "10.0.1.2"}, wlan("x", "a", "b")),
            "the hosts of network x are in several subnets: a 10.0.0.1, b 10.0.1.2",
            "set the `subnet` of the link",
        ),
        (
            swarm_of({"a": "10.0.0.1", "b": "10.0.1.2"}, wlan("x", "a", "b", subnet="10.0.0.0/24")),
            "host b has the address 10.0.1.2, which is in none of its networks",
            "correct the address",
        ),
        (
            swarm_of({"operator": "10.0.0.1"}),
            "`operator` is the lab's name for this machine",
            "rename the host",
        ),
    ],
    ids=["doubled", "overlap", "full", "several-subnets", "stray", "operator"],
)
def test_a_swarm_that_is_impossible_in_a_lab(swarm: Swarm, message: str, fix: str) -> None:
    with pytest.raises(LabError) as refusal:
        plan_of(swarm)
    assert message in str(refusal.value)
    assert fix in refusal.value.help_lines[0]


@given(st.sets(st.integers(1, 254), min_size=1, max_size=40))
def test_no_address_is_used_twice(numbers: set[int]) -> None:
    addresses = {f"h{number}": f"10.0.0.{number}" for number in sorted(numbers)}
    swarm = swarm_of(
        addresses,
        wlan("air", *addresses, subnet="10.0.0.0/24"),
        wlan("more", *addresses, subnet="10.1.0.0/16"),
    )
    plan = plan_of(swarm)
    given = [one.operator for one in plan.networks]
    given += [interface.address for host in plan.hosts for interface in host.interfaces]
    assert len(set(given)) == len(given)
    for network in plan.networks:
        inside = ipaddress.ip_network(network.subnet)
        operator = ipaddress.ip_interface(network.operator).ip
        assert operator in inside
        assert operator not in (inside.network_address, inside.broadcast_address)


def test_unknown_hosts_and_robots_list_the_known_ones(tmp_path: Path) -> None:
    plan = plan_from(tmp_path)
    with pytest.raises(LabError, match="lab tiny has no host `gamma`") as refusal:
        plan.host("gamma")
    assert refusal.value.help_lines == ("it has alpha, beta",)
    with pytest.raises(LabError, match="no robot `alpha`"):
        plan.robot("alpha")


def test_the_state_is_read_as_it_was_written(tmp_path: Path) -> None:
    home, state = LabPaths(tmp_path), State(plan_from(tmp_path), {"noetic": tmp_path / "image"})
    write_state(home, state)
    assert read_state(home) == state
    assert home.state.stat().st_mode & 0o777 == 0o600
    assert LabPlan.from_json(json.loads(json.dumps(state.plan.to_json()))) == state.plan


def test_a_state_of_another_format_is_an_error(tmp_path: Path) -> None:
    home = LabPaths(tmp_path)
    home.state.write_text('{"format": 0}')
    with pytest.raises(LabError, match="made by another version of swarmctl"):
        read_state(home)


def test_a_lab_that_was_never_up_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LabError, match="is not up") as refusal:
        read_state(LabPaths(tmp_path / "none"))
    assert refusal.value.help_lines == ("run `swarmctl lab up` first",)
