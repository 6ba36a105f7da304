"""Rules for islands of ROS 2: what they find, and what is silent because it is about masters."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.diagnostics import has_errors
from swarmctl.plugins import MIDDLEWARES
from swarmctl.render.middleware import middleware_of
from tests import ROOT
from tests.loading import load_swarm

SPECS = sorted((ROOT / "tests/render/ros2").glob("*.yaml"))
ROS_2 = [name for name in MIDDLEWARES.built_in if "domains" in middleware_of(name).capabilities]
PAIR = """\
version: 1
name: pair
mode: central
hub: laptop
ros: {ROS}
hosts:
  laptop: {address: 192.168.77.10}
  k3-pi: {address: 192.168.77.11}
robots:
  k3: {type: khepera3, host: k3-pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, k3-pi]}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
"""


def findings(folder: Path, ros: str, more: str = "") -> list[tuple[str, str]]:
    """The findings of a pair of hosts, with ``more`` sections."""
    spec = folder / "swarm.yaml"
    spec.write_text(PAIR.replace("{ROS}", f"{{{ros}}}") + more, "utf-8")
    return [(one.code, one.message) for one in load_swarm(spec)[1]]


def programs(count: int) -> str:
    lines = (f"  p{one}: {{host: laptop, package: moves, executable: wander}}\n" for one in range(count))
    return f"programs:\n{''.join(lines)}"


def codes(found: list[tuple[str, str]]) -> set[str]:
    return {code for code, _ in found}


@pytest.mark.parametrize("distro", ROS_2)
@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.stem)
def test_a_right_spec_has_no_error_with_any_distribution(spec: Path, distro: str, tmp_path: Path) -> None:
    other = tmp_path / spec.name
    other.write_text(spec.read_text("utf-8").replace("distro: kilted", f"distro: {distro}"), "utf-8")
    assert not has_errors(load_swarm(other)[1])


@pytest.mark.parametrize(
    ("ros", "most"),
    [
        ("distro: kilted, discovery: server", 120),
        ("distro: kilted, discovery: peers", 32),
        ("distro: kilted, rmw: cyclonedds, discovery: multicast", 32),
        ("distro: jazzy, discovery: peers", 32),
    ],
)
def test_a_host_has_no_more_processes_than_others_find(tmp_path: Path, ros: str, most: int) -> None:
    """ROS007"""
    assert "ROS007" not in codes(findings(tmp_path, f"{ros}, domain: 1", programs(most)))
    found = findings(tmp_path, f"{ros}, domain: 1", programs(most + 1))
    wanted = f"host `laptop` runs {most + 1} processes with nodes, and {most} can be found there"
    assert ("ROS007", wanted) in found


def test_a_host_of_zenoh_has_no_limit(tmp_path: Path) -> None:
    assert "ROS007" not in codes(findings(tmp_path, "distro: kilted, rmw: zenoh", programs(130)))


def test_the_76th_process_of_domain_17_has_the_port_of_the_server(tmp_path: Path) -> None:
    two = "the discovery server of `laptop` and DDS in domain 17 of `laptop`"
    clash = f"{two} both listen on UDP port 11811 of `192.168.77.10`"
    assert "PORT001" not in codes(
        findings(tmp_path, "distro: kilted, domain: 17, discovery: server", programs(75))
    )
    assert ("PORT001", clash) in findings(
        tmp_path, "distro: kilted, domain: 17, discovery: server", programs(76)
    )


@pytest.mark.parametrize(("domain", "clashes"), [(6, True), (7, False)])
def test_a_robot_sends_to_no_port_of_the_domain(tmp_path: Path, domain: int, clashes: bool) -> None:
    ros = f"distro: kilted, domain: {domain}"
    spec = PAIR.replace("k3: {type: khepera3, host: k3-pi}", "fly: {type: tello, host: k3-pi}")
    *above, _ = spec.splitlines(keepends=True)
    link = "  - {kind: udp, host: k3-pi, robot: fly, address: 192.168.10.1, local_ports: [8911, 11111]}\n"
    file = tmp_path / "swarm.yaml"
    file.write_text("".join(above).replace("{ROS}", f"{{{ros}}}") + link, "utf-8")
    assert ("PORT001" in {one.code for one in load_swarm(file)[1]}) is clashes


@pytest.mark.parametrize(("count", "warned"), [(54, False), (55, True)])
def test_the_55th_process_of_domain_101_has_a_port_of_connections(
    tmp_path: Path, count: int, warned: bool
) -> None:
    found = findings(tmp_path, "distro: kilted, domain: 101", programs(count))
    assert ("PORT005" in codes(found)) is warned


@pytest.mark.parametrize(
    "variable",
    ["ROS_DOMAIN_ID", "RMW_IMPLEMENTATION", "ROS_DISCOVERY_SERVER", "ROS_STATIC_PEERS", "CYCLONEDDS_URI"],
)
def test_a_program_sets_no_variable_of_the_island(tmp_path: Path, variable: str) -> None:
    program = f"programs: {{p: {{host: laptop, command: [p], environment: {{{variable}: x}}}}}}\n"
    assert "PROG008" in codes(findings(tmp_path, "distro: kilted", program))
    assert "PROG008" not in codes(findings(tmp_path, "distro: noetic", program))


def test_a_program_may_set_what_is_a_variable_of_ros_1_only(tmp_path: Path) -> None:
    program = "programs: {p: {host: laptop, command: [p], environment: {ROS_MASTER_URI: x}}}\n"
    assert "PROG008" not in codes(findings(tmp_path, "distro: kilted", program))


@pytest.mark.parametrize("commander", ["laptop", "p"])
def test_only_names_of_nodes_command(tmp_path: Path, commander: str) -> None:
    more = f"programs: {{p: {{host: laptop, command: [p]}}}}\ncontrol: [{{by: {commander}, of: [k3]}}]\n"
    assert "AUTH012" in codes(findings(tmp_path, "distro: kilted", more))
    assert "AUTH012" not in codes(findings(tmp_path, "distro: noetic", more))


def test_an_ungated_driver_takes_commands_of_every_node(tmp_path: Path) -> None:
    """The driver of the second robot checks no commander, so neither rule is about it."""
    spec = tmp_path / "swarm.yaml"
    driver = "driver: {package: d, executable: d, ungated: true, reason: its own dead-man}"
    text = PAIR.replace("{ROS}", "{distro: kilted}").replace("central\nhub", "leader\nleader")
    for entry, rules in (("[]", {"AUTH013"}), ("[{by: laptop, of: [k3]}]", {"AUTH012"})):
        spec.write_text(f"{text}control: {entry}\n", "utf-8")
        assert {one.code for one in load_swarm(spec)[1]} == rules
        spec.write_text(f"{text.replace('khepera3,', f'khepera3, {driver},')}control: {entry}\n", "utf-8")
        assert load_swarm(spec)[1] == ()


def test_a_publisher_is_not_authorised_by_its_host(tmp_path: Path) -> None:
    more = (
        "programs:\n  p:\n    host: laptop\n    package: moves\n    executable: p\n"
        "    publishes: [{topic: /k3/cmd_vel, type: geometry_msgs/Twist}]\n"
        "control: [{by: laptop, of: [k3]}]\n"
    )
    assert "AUTH004" in codes(findings(tmp_path, "distro: kilted", more))
    assert "AUTH004" not in codes(findings(tmp_path, "distro: noetic", more))


TOPICS = "topics: [{topic: /k3/odom, to: [laptop]}, {topic: /k3/odomm, to: [laptop]}]"


@pytest.mark.parametrize(
    "provider",
    [
        "",
        "multimaster: {provider: static, sync_hosts: [laptop]}\n",
        f"multimaster: {{{TOPICS}}}\n",
    ],
    ids=["none", "of masters", "topics"],
)
def test_islands_that_nothing_joins_have_one_error(tmp_path: Path, provider: str) -> None:
    """A provider of ROS 1 joins masters; its own rules have nothing to add."""
    spec = tmp_path / "swarm.yaml"
    text = PAIR.replace("{ROS}", "{distro: kilted, discovery: local}")
    text = text.replace("mode: central\nhub: laptop", "mode: standalone")
    text = text.replace("k3-pi]}", "k3-pi], client_isolation: true}")
    spec.write_text(text + provider, "utf-8")
    assert [one.code for one in load_swarm(spec)[1]] == ["MODE017"]


@pytest.mark.parametrize(
    ("ros", "why"),
    [
        ("distro: humble, servers: [laptop]", "a relay finds no nodes by discovery `server`"),
        ("distro: jazzy, discovery: local", "a relay finds no nodes by discovery `local`"),
        ("distro: jazzy, sros2: true", "a relay has no key of `sros2`"),
    ],
)
def test_islands_that_a_relay_cannot_join_are_an_error(tmp_path: Path, ros: str, why: str) -> None:
    spec = tmp_path / "swarm.yaml"
    text = PAIR.replace("{ROS}", f"{{{ros}}}").replace("mode: central\nhub: laptop", "mode: standalone")
    spec.write_text(text, "utf-8")
    messages = [one.message for one in load_swarm(spec)[1] if one.code == "MODE017"]
    assert messages == [f"the 2 islands of mode `standalone` share no topics: {why}"]


def test_a_single_standalone_host_needs_no_other(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    text = (ROOT / "tests/render/ros2/single-minded.yaml").read_text("utf-8")
    text = text.replace("mode: single-minded\nleader: laptop", "mode: standalone")
    spec.write_text(text.replace("{type: koala}", "{type: koala, host: laptop}"), "utf-8")
    assert load_swarm(spec)[1] == ()


def test_an_unreachable_server_is_a_host_without_its_hub(tmp_path: Path) -> None:
    more = "  - {kind: ethernet, name: far, hosts: [spare]}\n"
    spec = tmp_path / "swarm.yaml"
    text = PAIR.replace("{ROS}", "{distro: kilted, servers: [laptop, spare]}") + more
    spec.write_text(text.replace("robots:", "  spare: {address: 192.168.77.12}\nrobots:"), "utf-8")
    assert [one.code for one in load_swarm(spec)[1]] == ["NET001"]


@pytest.mark.parametrize(
    ("network", "rule"), [("multicast: false", "ROS005"), ("multicast: true", "")], ids=["dropped", "passed"]
)
def test_multicast_needs_a_network_that_passes_it(tmp_path: Path, network: str, rule: str) -> None:
    spec = tmp_path / "swarm.yaml"
    text = PAIR.replace("{ROS}", "{distro: kilted, discovery: multicast}")
    spec.write_text(text.replace("k3-pi]}", f"k3-pi], {network}}}"), "utf-8")
    assert [one.code for one in load_swarm(spec)[1]] == ([rule] if rule else [])


def test_few_processes_may_find_each_other_by_multicast(tmp_path: Path) -> None:
    ros = "distro: kilted, discovery: multicast"
    assert "ROS006" not in codes(findings(tmp_path, ros, programs(9)))
    assert "ROS006" in codes(findings(tmp_path, ros, programs(10)))


def test_a_port_of_a_master_has_no_effect(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    text = PAIR.replace("{ROS}", "{distro: kilted}").replace(".77.10}", ".77.10, master_port: 11312}")
    spec.write_text(text, "utf-8")
    assert [one.message for one in load_swarm(spec)[1]] == ["`kilted` does not use `master_port`"]


@pytest.mark.parametrize(
    ("program", "rule"),
    [
        ("{host: laptop, command: [p, '{hostname}']}", "PROG027"),
        ("{host: laptop, command: [p, '{master_uri}']}", "PROG027"),
        ("{host: laptop, package: p, launch: p.launch.py, args: {map: $(env MAP)}}", "PROG016"),
        ("{host: laptop, command: [p], remap: {a: b}}", "PROG026"),
        ("{host: laptop, package: p, executable: p, args: {a: b}}", "PROG025"),
        ("{host: laptop, package: p, executable: p, params: {map: $(find maps)/a}}", "PROG021"),
    ],
)
def test_what_no_launch_file_takes_is_an_error(tmp_path: Path, program: str, rule: str) -> None:
    found = findings(tmp_path, "distro: kilted", f"programs: {{p: {program}}}\n")
    assert codes(found) == {rule}


def test_a_template_has_no_uri_of_a_master(tmp_path: Path) -> None:
    (tmp_path / "site.j2").write_text("{{ master_uri }}", "utf-8")
    program = "programs: {p: {host: laptop, command: [p], files: {site.txt: {template: site.j2}}}}\n"
    assert codes(findings(tmp_path, "distro: kilted", program)) == {"PROG030"}
    assert codes(findings(tmp_path, "distro: noetic", program)) == set()


def test_words_of_an_executable_pass_as_they_stand(tmp_path: Path) -> None:
    program = "{host: laptop, package: p, executable: p, args: [$(env MAP)], environment: {A: $(b)}}"
    assert "PROG016" not in codes(findings(tmp_path, "distro: kilted", f"programs: {{p: {program}}}\n"))


def test_rosserial_python_is_of_ros_1(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    text = PAIR.replace("{ROS}", "{distro: kilted}")
    spec.write_text(text.replace("khepera3,", "arduino-rover, driver: rosserial_python,"), "utf-8")
    assert "DRIVER004" in {one.code for one in load_swarm(spec)[1]}
