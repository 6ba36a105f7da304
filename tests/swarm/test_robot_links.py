"""Robots that are connected by udp, tcp or radio: from the spec to the driver, the budgets and the views."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from swarmctl.analysis.budgets import budgets_of
from swarmctl.analysis.command_paths import command_path
from swarmctl.analysis.diagram import diagram
from swarmctl.analysis.impact import impacts
from swarmctl.analysis.network_load import network_budgets
from swarmctl.analysis.radio_load import seconds_of
from swarmctl.field_types import RADIO_RATES, RadioUri, RobotAddress
from swarmctl.health.expected_graph import Release, expected_graph
from swarmctl.lab.lab_plan import plan_of
from swarmctl.links.radio_link import Radio
from swarmctl.linter.runner import lint
from swarmctl.mode_conversion.convert import converted
from swarmctl.render.build_bundle import bundles
from swarmctl.scaffold.starting_files import starting_spec
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load
from swarmctl.spec.model import Mode
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import ForeignDriver, Swarm
from tests.swarm.documents import read

SPEC = """
version: 1
name: aviary
mode: central
hub: desk
hosts:
  desk: {address: 192.168.77.10, computer: laptop}
  pi: {address: 192.168.77.11, computer: raspberry-pi-4b}
robots:
  t-1: {type: tello, host: desk}
  uav: {type: mavros-apm, host: pi}
  rover: {type: mavros-px4, host: pi}
  cf-1: {type: crazyflie, host: pi}
  cf-2: {type: crazyflie, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [desk, pi]}
  - {kind: wlan, name: tello-ap, hosts: [desk], subnet: 192.168.10.0/24}
  - {kind: udp, host: desk, robot: t-1, address: 192.168.10.1, capacity_mbps: 8.0}
  - {kind: udp, host: pi, robot: uav, address: 192.168.77.50}
  - {kind: tcp, host: pi, robot: rover, address: rover.local, port: 5760, local_ports: [], system_id: 2}
  - {kind: radio, host: pi, robot: cf-1, uri: radio://0/80/2M/E7E7E7E701}
  - {kind: radio, host: pi, robot: cf-2, uri: radio://0/80/2M/e7e7e7e702}
control:
  - {by: desk, of: [t-1, uav, rover]}
ignore:
  - {rule: RADIO005, reason: one server of ours opens the dongle for both}
"""


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> SwarmIndex:
    return SwarmIndex(read(tmp_path_factory.mktemp("swarm"), SPEC))


@pytest.fixture(scope="module")
def swarm(index: SwarmIndex) -> Swarm:
    return resolve(index.document)


def test_the_swarm_of_these_tests_has_no_findings(index: SwarmIndex) -> None:
    assert lint(index.document) == ()


def started_with(swarm: Swarm, robot: str) -> dict[str, object]:
    driver = swarm.robots[robot].driver
    assert isinstance(driver, ForeignDriver)
    return {**driver.ros.params, **driver.ros.arguments}


def test_drivers_are_started_with_the_ends_of_their_links(swarm: Swarm) -> None:
    assert started_with(swarm, "t-1") == {
        "tello_ip": "192.168.10.1",
        "tello_cmd_server_port": 8889,
        "local_cmd_client_port": 8890,
        "local_vid_server_port": 6038,
    }
    assert started_with(swarm, "uav") == {
        "fcu_url": "udp://:14550@192.168.77.50:14555",
        "tgt_system": 1,
    }
    assert started_with(swarm, "rover") == {"fcu_url": "tcp://rover.local:5760", "tgt_system": 2}
    assert started_with(swarm, "cf-2") == {"uri": "radio://0/80/2M/E7E7E7E702", "frame": "cf_2"}


@given(
    st.integers(0, 15),
    st.integers(0, 125),
    st.sampled_from(sorted(RADIO_RATES)),
    st.integers(0, 2**40 - 1),
    st.booleans(),
)
def test_every_radio_uri_keeps_its_parts(
    dongle: int, channel: int, rate: str, address: int, lower: bool
) -> None:
    text = f"{dongle}/{channel}/{rate}/{address:010X}"
    link = Radio(kind="radio", host="pi", robot="cf", uri=f"radio://{text.lower() if lower else text}")
    parts = (link.dongle, link.channel, link.rate, link.address)
    assert parts == (f"crazyradio{dongle}", channel, RADIO_RATES[rate], f"{address:010X}")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("radio://0/126/2M", "channels 0 to 125"),
        ("radio://0/80/3M", "250K, 1M, 2M"),
        ("radio://0/80/2M/E7", "ten hexadecimal digits"),
        ("radio://16/80/2M", "dongles 0 to 15"),
        ("usb://0", "like radio://0/80/2M/E7E7E7E7E7"),
    ],
)
def test_wrong_radio_uris_say_what_to_write(text: str, problem: str) -> None:
    with pytest.raises(ValidationError, match=problem):
        TypeAdapter(RadioUri).validate_python(text)


@pytest.mark.parametrize("text", ["0.0.0.0", "224.0.0.1", "255.255.255.255", "::1", "todo", "10.0.0.300"])
def test_addresses_that_no_robot_has_are_errors(text: str) -> None:
    with pytest.raises(ValidationError):
        TypeAdapter(RobotAddress).validate_python(text)


def test_robots_on_one_dongle_share_its_time(index: SwarmIndex) -> None:
    (budget,) = budgets_of(index).dongles
    assert (budget.host, budget.dongle, budget.members) == ("pi", "crazyradio0", ("cf-1", "cf-2"))
    # 100 Hz of imu, four topics of 10 Hz, and commands at the usual 10 Hz. On the air: 2 packets of 329 bits
    # at 2 Mbit/s and 2 turns of 130 us; USB: a frame of 1 ms for the exchange and one for the other address.
    assert budget.exchanges == (150.0, 150.0)
    assert budget.share == pytest.approx(300 * (2 * 329 / 2e6 + 260e-6 + 2e-3))
    assert seconds_of(250_000, shared=False) == pytest.approx(2 * 329 / 250e3 + 260e-6 + 1e-3)


def test_what_a_robot_sends_counts_on_its_link_and_network(index: SwarmIndex) -> None:
    found = {one.robot: one for one in budgets_of(index).ip_links}
    assert (found["t-1"].needed_mbps, found["t-1"].share, found["t-1"].network) == (2.0, 0.25, "tello-ap")
    assert found["uav"].network == "lab"
    assert found["uav"].share is None  # nobody has measured its network
    assert found["rover"].network is None  # only its host can resolve the name
    networks = {one.network: one for one in network_budgets(index)}
    assert networks["tello-ap"].needed_mbps == pytest.approx(2.0)
    assert any(flow.to == "uav" for flow in networks["lab"].flows)


def test_a_dongle_and_an_access_point_take_their_robots_along(index: SwarmIndex) -> None:
    lost = {(one.kind, one.name): one.drivers for one in impacts(index)}
    assert lost["adapter", "pi/crazyradio0"] == ("cf-1", "cf-2")
    assert lost["network", "tello-ap"] == ("t-1",)
    assert lost["line", "rover"] == ("rover",)


def test_the_graph_shows_kind_and_end_of_each_link(index: SwarmIndex) -> None:
    found = {
        one.end: (one.kind, one.label) for one in diagram(index).edges if one.kind in ("udp", "tcp", "radio")
    }
    assert found["robot:t-1"] == ("udp", "192.168.10.1:8889")
    assert found["robot:rover"] == ("tcp", "rover.local:5760")
    assert found["robot:cf-2"] == ("radio", "crazyradio0, channel 80")


def test_a_command_travels_over_the_network_of_the_robot(index: SwarmIndex) -> None:
    hops = [(one.kind, one.name, one.detail) for one in command_path(index, "desk", "uav").hops]
    assert hops[-3:] == [("network", "lab", ""), ("line", "uav", "udp"), ("robot", "uav", "mavros-apm")]


def test_a_host_with_a_crazyradio_gets_its_udev_rule(swarm: Swarm) -> None:
    found = bundles(swarm)
    rules = {one.path: one.content.decode() for one in found["pi"].files if one.path.startswith("udev/")}
    assert list(rules) == ["udev/60-swarm.rules"]
    assert 'ATTR{idVendor}=="1915", ATTR{idProduct}=="7777", GROUP="plugdev"' in rules["udev/60-swarm.rules"]
    assert not any(one.path.startswith("udev/") for one in found["desk"].files)


def test_a_silent_robot_has_a_hint_at_its_link(swarm: Swarm) -> None:
    releases = {name: Release("0" * 64, ()) for name in swarm.hosts}
    hints = {one.name: one.reach for one in expected_graph(swarm, releases).robots}
    assert hints["t-1"].startswith("on desk: ping -c 3 192.168.10.1;")
    assert "radio://0/80/2M/E7E7E7E701" in hints["cf-1"]


def test_a_lab_has_a_stand_in_for_each_of_them(swarm: Swarm) -> None:
    plan = plan_of(swarm)
    assert [one.robot for one in plan.stand_ins] == ["t-1", "uav", "rover", "cf-1", "cf-2"]
    assert plan.robots == ()  # no device to emulate


def test_another_mode_names_what_to_move(index: SwarmIndex) -> None:
    steps = converted(index.document, Mode.SINGLE_MINDED).by_hand
    assert "check that `desk` reaches `uav` at 192.168.77.50: `ping 192.168.77.50` there" in steps
    assert "plug a Crazyradio for `cf-1` into `desk` as its crazyradio0" in steps


def test_a_first_spec_has_their_links(tmp_path: Path) -> None:
    robots = {"t-1": "tello", "cf-1": "crazyflie", "cf-2": "crazyflie", "uav": "mavros-apm"}
    text = starting_spec("aviary", Mode.CENTRAL, robots, load_catalog().types)
    document = read(tmp_path, text)
    assert {link.robot: link.kind for _, link in SwarmIndex(document).lines} == {
        "t-1": "udp", "cf-1": "radio", "cf-2": "radio", "uav": "serial",
    }  # fmt: skip
    found = {one.code for one in lint(document)}
    assert {code for code in found if code[:4] in ("LINK", "RADI", "ID00", "PORT")} == {"LINK013"}


@pytest.mark.parametrize(
    ("old", "new", "code", "words"),
    [
        ("capacity_mbps: 8.0", "capacity_mbps: 2.5", "LINK012", "has to carry 2 of 2.5 Mbit/s"),
        ("capacity_mbps: 8.0", "capacity_mbps: 1.5", "LINK015", "has to carry 2 of 1.5 Mbit/s"),
        ("e7e7e7e702", "E7E7E7E701", "ID009", "`cf-1` and robot `cf-2`"),
        ("radio://0/80/2M/e7e7e7e702", "radio://1/81/1M/E7E7E7E702", "RADIO004", "80 and 81"),
        ("kind: tcp, host: pi, robot: rover", "kind: radio, host: pi, robot: rover", "SPEC", "`uri`"),
    ],
)
def test_wrong_links_are_found(tmp_path: Path, old: str, new: str, code: str, words: str) -> None:
    assert old in SPEC
    path = tmp_path / "swarm.yaml"
    path.write_text(SPEC.replace(old, new), "utf-8")
    document, reported = load([path])
    found = [*reported, *(lint(document) if document is not None else ())]
    assert any(one.code.startswith(code) and words in one.message for one in found), found


def test_two_drivers_of_a_host_need_different_ports(tmp_path: Path) -> None:
    twins = SPEC.replace("robots:\n", "robots:\n  t-2: {type: tello, host: desk}\n").replace(
        "links:\n", "links:\n  - {kind: udp, host: desk, robot: t-2, address: 192.168.77.52}\n"
    )
    clash = next(one for one in lint(read(tmp_path, twins)) if one.code == "PORT001")
    assert "`t-2`" in clash.message
    assert "UDP port 8890" in clash.message
    apart = twins.replace("address: 192.168.77.52}", "address: 192.168.77.52, local_ports: [8892, 6039]}")
    assert "PORT001" not in {one.code for one in lint(read(tmp_path, apart))}


def test_access_points_of_two_hosts_may_have_one_address(tmp_path: Path) -> None:
    def found(host: str) -> set[str]:
        more = (
            f"  - {{kind: udp, host: {host}, robot: t-2, address: 192.168.10.1, local_ports: [8892, 6039]}}\n"
        )
        text = SPEC.replace("robots:\n", f"robots:\n  t-2: {{type: tello, host: {host}}}\n")
        return {one.code for one in lint(read(tmp_path, text.replace("links:\n", f"links:\n{more}")))}

    assert "ID008" in found("desk")
    assert "ID008" not in found("pi")


def test_a_link_without_the_port_says_where_to_write_it(tmp_path: Path) -> None:
    own = (
        'types:\n  mine:\n    title: Mine\n    driver: {package: a, executable: b, params: {url: "{uri}"}}\n'
    )
    own += "    kinematics: {kind: none}\n    link: {kinds: [tcp]}\n"
    text = own + SPEC.replace("type: mavros-px4", "type: mine").replace("port: 5760, ", "")
    text = text.replace("[t-1, uav, rover]", "[t-1, uav]")
    found = next(one for one in lint(read(tmp_path, text)) if one.code == "DRIVER001")
    assert "write `port` in the link of `rover`" in found.help[0]
