"""Bundles of ROS 2: the exact bytes of what is not as in ROS 1, and what bash, systemd and XML make of it."""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.linter.context import RuleContext
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.render.quoting import render
from swarmctl.render.ros2 import distros
from swarmctl.spec.load import load
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm
from tests.render.rendered import bundle_of, text_of

SPECS, GOLDEN = ROOT / "tests/render/ros2", ROOT / "tests/render/golden/ros2"
#: What a release of ROS 1 has as well.
ALIKE = re.compile(
    r"(drivers|gate|teleop|firmware|urdf|udev|chrony|hosts|network)/|bin/[a-z-]*-[a-z-]*$"
    r"|params/(koala|k3|ep|rover|p3\.gate)\.yaml|units/.*\.(wlan|pair|rfcomm|target)|maintenance"
)
#: What depends on how nodes find each other.
OF_DISCOVERY = re.compile(r"env/|setup\.bash$|units/.*\.discovery\.service$")


def swarm_of(folder: Path, name: str, ros: str = "", mode: str = "") -> Swarm:
    text = (SPECS / f"{name}.yaml").read_text("utf-8")
    text = re.sub("^ros: .*", f"ros: {{{ros}}}", text, flags=re.MULTILINE) if ros else text
    spec = folder / "swarm.yaml"
    spec.write_text(text.replace("mode: central\nhub:", "mode: leader\nleader:") if mode else text, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return swarm


def made(folder: Path, name: str, ros: str = "", mode: str = "") -> Mapping[str, Bundle]:
    return bundles(swarm_of(folder, name, ros, mode))


#: By golden folder: the spec, its `ros`, and its mode if that is another.
CASES = {
    "central": ("central", "", ""),
    "single-minded": ("single-minded", "", ""),
    "single-minded-jazzy": ("single-minded", "distro: jazzy", ""),
    "leader": ("central", "distro: jazzy, domain: 42, discovery: server", "leader"),
    "humble": ("central", "distro: humble, discovery: server", ""),
    "humble-peers": ("central", "distro: humble, discovery: peers", ""),
    "jazzy-peers": ("central", "distro: jazzy, discovery: peers", ""),
    "peers": ("central", "distro: kilted, discovery: peers", ""),
    "multicast": ("central", "distro: kilted, discovery: multicast", ""),
    "cyclonedds": ("central", "distro: kilted, rmw: cyclonedds", ""),
    "zenoh": ("central", "distro: kilted, rmw: zenoh, servers: [hub-pc, koala-laptop]", ""),
}


@pytest.mark.parametrize("case", CASES)
def test_golden(case: str, tmp_path: Path, golden: Callable[[Path, str], None], regenerating: bool) -> None:
    whole, root, expected = case == "central", GOLDEN / case, set()
    if regenerating:
        shutil.rmtree(root, ignore_errors=True)
    for host, bundle in made(tmp_path, *CASES[case]).items():
        for file in bundle.files:
            if (whole and not ALIKE.match(file.path)) or OF_DISCOVERY.match(file.path):
                golden(root / host / file.path, file.content.decode())
                expected.add(f"{host}/{file.path}")
        if whole:
            needs = (
                f"{one.name}: {' '.join(path for path in one.needs if not ALIKE.match(path))}\n"
                for one in bundle.units
            )
            golden(root / host / "UNITS", "".join(needs))
            golden(
                root / host / "REQUIRES", yaml.safe_dump({key: [*of] for key, of in bundle.requires.items()})
            )
            expected |= {f"{host}/UNITS", f"{host}/REQUIRES"}
    assert {str(one.relative_to(root)) for one in root.rglob("*") if one.is_file()} == expected


#: What the drivers of vendors are started with, and how the hosts of robots with nodes find these.
OF_VENDORS = re.compile(r"launch/|params/(?!.*\.gate)|env/fastdds\.xml$")


def test_golden_of_vendors(tmp_path: Path, golden: Callable[[Path, str], None]) -> None:
    """Every package of ROS 2 in the catalog, behind the gate or, where it takes no velocities, without."""
    for host, bundle in made(tmp_path, "vendors").items():
        for file in bundle.files:
            if OF_VENDORS.match(file.path) and (host == "tb4-pi" or not file.path.startswith("env/")):
                golden(GOLDEN / "vendors" / host / file.path, file.content.decode())


def test_every_need_and_every_link_is_a_file_of_the_bundle(tmp_path: Path) -> None:
    for bundle in made(tmp_path, "central").values():
        paths = {file.path for file in bundle.files}
        assert len(paths) == len(bundle.files)
        assert {path for unit in bundle.units for path in unit.needs} <= paths


def test_no_file_is_of_ros_1(tmp_path: Path) -> None:
    own = (
        file
        for bundle in made(tmp_path, "central").values()
        for file in bundle.files
        if not file.path.startswith(("drivers/", "gate/", "teleop/", "firmware/"))
    )
    words = re.compile(
        rb"ROS_MASTER_URI|roslaunch|ros-client|__ns:=(?!/)|__name:=|send_zero|catkin|[^a-z]11311"
    )
    assert [file.path for file in own if words.search(file.content)] == []


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
@pytest.mark.parametrize("ros", ["", "distro: kilted, sros2: true"])
def test_systemd_finds_nothing_wrong_with_the_units(ros: str, tmp_path: Path) -> None:
    bundle, units = made(tmp_path, "central", ros)["hub-pc"], tmp_path / "etc/systemd/system"
    release = tmp_path / bundle.home[1:] / "current"
    for file in bundle.files:
        (release / file.path).parent.mkdir(parents=True, exist_ok=True)
        (release / file.path).write_bytes(file.content)
        (release / file.path).chmod(file.mode)
    (tmp_path / "usr/bin").mkdir(parents=True)
    (tmp_path / "usr/bin/python3").touch(0o755)
    shutil.copytree(release / "units", units)
    for name in ("sysinit", "basic", "shutdown", "multi-user"):
        (units / f"{name}.target").write_text("[Unit]\nDefaultDependencies=no\n")
    names = [unit.name for unit in bundle.units]
    command = ["systemd-analyze", "verify", "--man=no", f"--root={tmp_path}", *names]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout + ran.stderr) == (0, "")


def test_xml_files_are_xml(tmp_path: Path) -> None:
    for ros in (
        "distro: humble, discovery: server",
        "distro: humble, discovery: peers",
        "distro: jazzy, rmw: cyclonedds",
    ):
        files = [file for bundle in made(tmp_path, "central", ros).values() for file in bundle.files]
        texts = [file.content for file in files if file.path.endswith(".xml")]
        assert texts
        for text in texts:
            ET.fromstring(text)


VALUES = st.text(
    st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp"), exclude_characters="\x85")
).filter(lambda text: text.isprintable())


@given(value=VALUES)
def test_values_survive_systemd_and_bash(value: str) -> None:
    """systemd's EnvironmentFile= is read as by a POSIX shell, in which no other command may start."""
    empty = {"swarm": "s", "distro": "kilted", "workspaces": (), "address": ""}
    env = render("ros2/ros.env", variables=[("ROS_STATIC_PEERS", value)], **empty)
    setup = render(
        "ros2/setup.bash", home="/opt/swarm/s", unset=[], variables=[("ROS_STATIC_PEERS", value)], **empty
    )
    for text in (env, setup):
        script = text.decode() + '\nprintf %s "$ROS_STATIC_PEERS"'
        ran = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
        assert (ran.stdout, ran.stderr) == (value, "")


def test_a_terminal_has_no_variable_of_another_graph(tmp_path: Path) -> None:
    script = text_of(made(tmp_path, "single-minded")["laptop"], "setup.bash")
    given_ones = {
        "ROS_DISCOVERY_SERVER": "10.0.0.1:11811",
        "ROS_SUPER_CLIENT": "TRUE",
        "PATH": "/usr/bin:/bin",
    }
    ran = subprocess.run(
        ["bash", "-c", f"{script}\nenv"], env=given_ones, capture_output=True, text=True, check=True
    )
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST\n" in ran.stdout
    assert "ROS_DISCOVERY_SERVER" not in ran.stdout
    assert "ROS_SUPER_CLIENT" not in ran.stdout


def test_the_expected_graph_has_types_of_ros_2(tmp_path: Path) -> None:
    swarm = swarm_of(tmp_path, "central")
    kilted = distros.KILTED
    driver = kilted.driver(swarm, swarm.robots["p3"])
    assert (driver.node, driver.command, driver.command_type) == (
        "/p3/driver",
        "/p3/cmd_vel",
        "geometry_msgs/msg/Twist",
    )
    assert driver.gate is not None
    assert driver.gate.output_type == "geometry_msgs/msg/Twist"
    assert {one.type.count("/") for one in kilted.driver(swarm, swarm.robots["k3"]).topics} == {2}
    published = kilted.program(swarm, swarm.programs["joystick"]).publishes
    assert ("/k3/cmd_vel", "geometry_msgs/msg/Twist") in published
    assert kilted.type_name("nav_msgs/msg/Odometry") == kilted.type_name("nav_msgs/Odometry")


@pytest.mark.parametrize(
    ("ros", "expected"),
    [
        (
            "distro: kilted, domain: 42, discovery: server",
            {("hub-pc", 11811, "udp"), ("k3-pi", 17910, "udp"), ("k3-pi", 17915, "udp")},
        ),
        ("distro: kilted, domain: 42, discovery: peers", {("k3-pi", 17900, "udp"), ("k3-pi", 17910, "udp")}),
        ("distro: kilted, rmw: zenoh", {("hub-pc", 7447, "tcp")}),
    ],
)
def test_the_ports_follow_from_domain_and_servers(
    tmp_path: Path, ros: str, expected: set[tuple[str, int, str]]
) -> None:
    swarm_of(tmp_path, "central", ros)

    document, _ = load([tmp_path / "swarm.yaml"])
    assert document is not None
    context = RuleContext(document)
    found = {(one.host, one.port, one.protocol) for one in context.listeners if one.port != 22}
    assert expected <= found
    in_domain = {port for host, port, _ in found if host == "k3-pi"}
    assert len(in_domain) == (0 if "zenoh" in ros else 7 if "peers" in ros else 6)


def test_a_missing_package_has_its_debian_package() -> None:
    assert distros.JAZZY.debian_packages("package:rmw_zenoh_cpp") == ("ros-jazzy-rmw-zenoh-cpp",)
    assert distros.JAZZY.debian_packages("pyserial") == ("python3-serial",)
    [workspace, packages] = distros.KILTED.install_hints(
        ["workspace:/home/robot/ws", "package:rclpy", "pyserial"]
    )
    assert workspace.startswith("`cd /home/robot/ws && colcon build`")
    assert packages.startswith("`apt install ros-kilted-rclpy python3-serial`")


CREATE = """\
version: 1
name: create
mode: {mode}
ros: {{distro: kilted}}
hosts: {{desk: {{address: 192.168.77.10}}, pi: {{address: 192.168.77.11}}}}
robots:
  base: {{type: create3, host: desk, driver: {{package: republisher, executable: republisher, peer: true}}}}
links:
  - {{kind: wlan, name: lab, hosts: [desk, pi]}}
  - {{kind: udp, host: desk, robot: base, address: 192.168.186.2}}
"""


@pytest.mark.parametrize(
    ("mode", "peers"),
    [("central\nhub: desk", "192.168.77.11;192.168.186.2"), ("single-minded\nleader: desk", "192.168.186.2")],
)
def test_nodes_look_for_a_robot_that_runs_nodes_itself(tmp_path: Path, mode: str, peers: str) -> None:
    desk = bundle_of(tmp_path, CREATE.format(mode=mode), "desk")
    assert f'ROS_STATIC_PEERS="{peers}"' in text_of(desk, "env/ros.env")


def test_nodes_of_other_hosts_do_not_look_for_it(tmp_path: Path) -> None:
    other = bundle_of(tmp_path, CREATE.format(mode="central\nhub: desk"), "pi")
    assert 'ROS_STATIC_PEERS="192.168.77.10"' in text_of(other, "env/ros.env")


TURTLEBOT4 = """\
version: 1
name: tb4lab
mode: central
hub: pc
security: filtered
ros: {distro: jazzy, servers: [t1, t2, pc]}
hosts:
  pc: {address: 192.168.77.100}
  t1: {address: 192.168.77.120}
  t2: {address: 192.168.77.102}
robots:
  a: {type: turtlebot4, host: t1}
  b: {type: turtlebot4, host: t2}
links:
  - {kind: wlan, name: lab, hosts: [pc, t1, t2]}
  - {kind: udp, host: t1, robot: a, address: 192.168.186.2}
  - {kind: udp, host: t2, robot: b, address: 192.168.187.2, host_address: 192.168.187.3}
"""


UNIT = "units/swarm-tb4lab.discovery.service"


@pytest.mark.parametrize(
    ("host", "words"),
    [
        ("t1", "-i 0 -l 192.168.77.120 -p 11811 -l 192.168.186.3 -p 11811"),
        ("t2", "-i 1 -l 192.168.77.102 -p 11811 -l 192.168.187.3 -p 11811"),
        ("pc", "-i 2 -l 192.168.77.100 -p 11811"),
    ],
)
def test_a_server_listens_where_the_robot_of_its_host_reaches_it(
    host: str, words: str, tmp_path: Path
) -> None:
    unit = text_of(bundle_of(tmp_path, TURTLEBOT4, host), UNIT).splitlines()
    assert [one for one in unit if one.endswith(f"/ros-exec fastdds discovery {words}")]


def test_such_a_robot_passes_the_firewall_and_the_ip_list_of_its_host(tmp_path: Path) -> None:
    t1 = bundle_of(tmp_path, TURTLEBOT4, "t1")
    unit, table = text_of(t1, UNIT).splitlines(), text_of(t1, "firewall.nft")
    assert {f"IPAddressAllow=192.168.186.{one}" for one in (2, 3)} <= set(unit)
    assert "IPAddressAllow=192.168.187.3" not in unit
    (accepted,) = re.findall("udp dport 11811 ip saddr {(.*)} accept", table)
    assert "192.168.186.2" in accepted


@pytest.mark.parametrize(("host", "address"), [("t1", "0.0.0.0"), ("pc", "192.168.77.100")])
def test_a_router_of_such_a_host_listens_at_every_address(host: str, address: str, tmp_path: Path) -> None:
    text = TURTLEBOT4.replace("distro: jazzy", "distro: jazzy, rmw: zenoh")
    assert f"tcp/{address}:7447" in text_of(bundle_of(tmp_path, text, host), UNIT).partition("connect")[0]


@pytest.mark.parametrize(
    ("ros", "rmw", "server"),
    [
        ("servers: [t1, t2, pc]", "rmw_fastrtps_cpp", "discovery server ;192.168.187.3:11811"),
        ("servers: [t2]", "rmw_fastrtps_cpp", "discovery server 192.168.187.3:11811"),
        (
            "servers: [pc]",
            "rmw_fastrtps_cpp",
            "and add t2 to `ros.servers`: over its link it reaches no other host",
        ),
        ("servers: [t2], rmw: zenoh", "rmw_zenoh_cpp", 'routers ["tcp/192.168.187.3:7447"]'),
    ],
)
def test_a_release_says_what_a_person_sets_on_a_robot(
    ros: str, rmw: str, server: str, tmp_path: Path
) -> None:
    bundle = bundle_of(tmp_path, TURTLEBOT4.replace("servers: [t1, t2, pc]", ros), "t2")
    robot = "robot b (192.168.187.2)"
    assert set(bundle.by_hand) == {
        f"{robot} runs nodes itself; set on it: domain 58, {rmw}, namespace /b/_do_not_use, {server}",
        f"{robot} has a clock of its own; set its time server to 192.168.187.3",
    }
    assert "\nallow 192.168.187.2\n" in text_of(bundle, "chrony/block")


def test_a_robot_in_the_network_of_the_hosts_reaches_every_server(tmp_path: Path) -> None:
    text = CREATE.format(mode="central\nhub: desk").replace("kilted", "jazzy, discovery: server")
    text = text.replace("192.168.186.2", "192.168.77.12").replace("server}", "server, servers: [pi, desk]}")
    (note,) = bundle_of(tmp_path, text, "desk").by_hand
    assert note.endswith("discovery server 192.168.77.11:11811;192.168.77.10:11811")
