"""Clearpath's robot.yaml, as files of Humble and of Jazzy have it."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.importing.drafting import DraftError, Imported
from tests.importing.drafts import data, draft, lab, odd, vanished

HUMBLE = """serial_number: j100-0001
system:
  hosts:
    self: cpr-j100-0001
    platform: {cpr-j100-0001: 192.168.131.1}
    onboard: {gpu: 192.168.131.2}
    remote: {}
  ros2: {username: administrator, namespace: j100_0001}
"""


def test_hosts_by_group_are_read(tmp_path: Path) -> None:
    found = data(draft(lab(tmp_path, {"robot.yaml": HUMBLE})))
    assert found["hosts"] == {
        "cpr-j100-0001": {"address": "192.168.131.1", "user": "administrator"},
        "gpu": {"address": "192.168.131.2", "user": "administrator"},
    }


def test_a_known_platform_is_a_robot_type(tmp_path: Path) -> None:
    found = data(draft(lab(tmp_path, {"robot.yaml": HUMBLE})))
    assert found["robots"] == {"j100-0001": {"type": "clearpath-j100", "host": "cpr-j100-0001"}}
    assert (found["mode"], found["hub"], found["ros"]) == ("central", "cpr-j100-0001", {"distro": "humble"})


def test_another_platform_is_to_fill_in(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"robot.yaml": HUMBLE.replace("j100-", "r100-")}))
    assert data(found)["robots"] == {"j100-0001": {"host": "cpr-r100-0001"}}
    assert "# type: my-robot  # fill in: swarmctl has no type for r100; `swarmctl driver new`" in found.text


def test_the_domain_is_kept(tmp_path: Path) -> None:
    text = "serial_number: a\nsystem: {hosts: [{hostname: pi, ip: 192.168.131.1}], ros2: {domain_id: 7}}\n"
    assert data(draft(lab(tmp_path, {"robot.yaml": text})))["ros"] == {"distro": "jazzy", "domain": 7}


def test_several_files_are_one_fleet(tmp_path: Path) -> None:
    """Computers of robots have the same address as delivered; one that both files name is one host."""
    base = "  hosts: [{hostname: NAME, ip: 192.168.131.1}, {hostname: base, ip: 192.168.131.5}]"
    files = {
        f"{name}/robot.yaml": f"serial_number: {name}\nsystem:\n{base.replace('NAME', f'cpr-{name}')}\n"
        for name in ("a200-0001", "j100-0002")
    }
    found = draft(lab(tmp_path, files))
    assert list(data(found)["hosts"]) == ["cpr-a200-0001", "base", "cpr-j100-0002"]
    robots = {
        name: {"type": f"clearpath-{name[:4]}", "host": f"cpr-{name}"} for name in ("a200-0001", "j100-0002")
    }
    assert data(found)["robots"] == robots
    line = next(one for one in found.text.split("\n") if "  cpr-j100-0002:" in one)
    assert "fill in: " in line


def test_robots_that_name_one_computer_as_theirs_are_named(tmp_path: Path) -> None:
    text = (
        "serial_number: a\nsystem:\n  hosts: [{hostname: pi, ip: 192.168.131.1}]\n  ros2: {namespace: NAME}\n"
    )
    found = draft(lab(tmp_path, {f"{one}/robot.yaml": text.replace("NAME", one) for one in ("r1", "r2")}))
    assert data(found)["robots"] == {"r1": {"host": "pi"}, "r2": {"host": "pi"}}
    assert "own computer, and r1 names the same one (r2/robot.yaml:3); check" in found.text


def test_a_file_without_hosts_is_refused(tmp_path: Path) -> None:
    files = {"robot.yaml": "serial_number: j100-0001\nsystem: {ros2: {namespace: j}}\n"}
    with pytest.raises(DraftError, match="names no host"):
        draft(lab(tmp_path, files))


def robot(name: str, ros: str, *others: str, hosts: str = "") -> str:
    """A robot.yaml in the form of Jazzy, whose robot has a computer of its own."""
    lines = [
        f"serial_number: {name}",
        "system:",
        f"  hosts: [{{hostname: cpr-{name}, ip: 192.168.77.{name[-2:]}}}{hosts}]",
        f"  ros2: {{namespace: {name.replace('-', '_')}, {ros}}}",
        *others,
    ]
    return "".join(f"{one}\n" for one in lines)


def fleet(folder: Path, *texts: str) -> Imported:
    return draft(lab(folder, {f"r{number}/robot.yaml": text for number, text in enumerate(texts, 1)}))


def served(*servers: str, rmw: str = "rmw_fastrtps_cpp") -> str:
    return f"middleware: {{implementation: {rmw}, discovery: server, servers: [{', '.join(servers)}]}}"


def test_robots_of_different_domains_are_islands(tmp_path: Path) -> None:
    server = served("{hostname: cpr-j100-0031, server_id: 0}")
    made = fleet(
        tmp_path,
        robot("j100-0031", f"domain_id: 12, {server}"),
        robot("j100-0032", f"domain_id: 14, {server}"),
    )
    found = data(made)
    assert (found["mode"], "hub" in found) == ("combined", False)
    assert found["islands"] == {
        "domain-12": {"mode": "central", "hub": "cpr-j100-0031", "hosts": ["cpr-j100-0031"]},
        "domain-14": {"mode": "central", "hub": "cpr-j100-0032", "hosts": ["cpr-j100-0032"]},
    }
    assert found["ros"] == {
        "distro": "jazzy", "domain": 12, "rmw": "fastrtps", "discovery": "server",
        "servers": ["cpr-j100-0031"],
    }  # fmt: skip
    assert "#   r2/robot.yaml:4: the domain 14; a spec numbers the islands on" in made.text
    assert "#   r2/robot.yaml:4: server `cpr-j100-0031`: it is in another island" in made.text


def test_a_computer_of_all_robots_is_in_one_island(tmp_path: Path) -> None:
    base = ", {hostname: base, ip: 192.168.77.5}"
    made = fleet(
        tmp_path,
        robot("j100-0031", "domain_id: 12", hosts=base),
        robot("j100-0032", "domain_id: 13", hosts=base),
    )
    members = {name: one["hosts"] for name, one in data(made)["islands"].items()}
    assert members == {"domain-12": ["cpr-j100-0031", "base"], "domain-13": ["cpr-j100-0032"]}
    why = "it is in the island of domain 12, and a host is in one"
    assert f"#   r2/robot.yaml:3: host `base` in domain 13; {why}" in made.text


def test_a_domain_whose_hosts_are_all_taken_is_named(tmp_path: Path) -> None:
    texts = [robot("j100-0031", f"domain_id: {one}") for one in (12, 13)]
    made = fleet(tmp_path, *texts)
    assert "islands" not in data(made)
    assert data(made)["ros"]["domain"] == 12
    assert "#   r2/robot.yaml:4: domain_id 13: no host is left for its island" in made.text


def test_a_file_without_a_domain_has_the_usual_one(tmp_path: Path) -> None:
    made = fleet(tmp_path, robot("j100-0031", "domain_id: 1"), robot("j100-0032", ""))
    assert {name: one["hosts"] for name, one in data(made)["islands"].items()} == {
        "domain-0": ["cpr-j100-0032"], "domain-1": ["cpr-j100-0031"],
    }  # fmt: skip
    assert "are an island; a robot.yaml without domain_id has the domain 0" in made.text


def test_a_domain_that_a_spec_cannot_have_is_named(tmp_path: Path) -> None:
    made = fleet(tmp_path, robot("j100-0031", "domain_id: 12"), robot("j100-0032", "domain_id: 200"))
    assert data(made)["ros"]["domain"] == 12
    assert "#   r2/robot.yaml:4: domain_id is none from 0 to 101" in made.text


def test_servers_have_the_order_of_their_numbers(tmp_path: Path) -> None:
    hosts = "".join(
        f", {{hostname: {name}, ip: 192.168.77.{number}}}" for name, number in (("a", 5), ("b", 6))
    )
    server = served(
        "{hostname: a, server_id: 2}", "{ip: 192.168.77.6, server_id: 1}", "{hostname: cpr-j100-0031}"
    )
    made = fleet(tmp_path, robot("j100-0031", server, hosts=hosts))
    assert data(made)["ros"]["servers"] == ["cpr-j100-0031", "b", "a"]
    assert "server_id" not in made.text


@pytest.mark.parametrize(
    ("server", "why"),
    [
        ("{hostname: away, server_id: 1}", "server `away`: no host of these files has this name or address"),
        ("{hostname: a, enabled: false}", "server `a`: it is not enabled"),
        ("{hostname: cpr-j100-0031, port: 11812}", "server `cpr-j100-0031`: its host has one at"),
        ("{ip: 'http://a:hunter2@b'}", "server what may be a secret: no host"),
    ],
)
def test_a_server_that_is_not_taken_is_named(tmp_path: Path, server: str, why: str) -> None:
    hosts = ", {hostname: a, ip: 192.168.77.5}"
    made = fleet(
        tmp_path, robot("j100-0031", served("{hostname: cpr-j100-0031, enabled: true}", server), hosts=hosts)
    )
    assert data(made)["ros"]["servers"] == ["cpr-j100-0031"]
    assert f"#   r1/robot.yaml:4: {why}" in made.text
    assert "hunter2" not in made.text


@pytest.mark.parametrize(
    ("field", "why"),
    [
        ("port: 11900", "port `11900`; swarmctl takes 11811"),
        ("server_id: 3", "server_id 3: `cpr-j100-0031` has the number 0 in a spec, its place in `servers`"),
        ("ip: 10.0.0.1", "system.ros2.middleware.servers.ip: a spec has only the hosts of servers"),
    ],
)
def test_what_a_server_has_beside_its_host_is_named(tmp_path: Path, field: str, why: str) -> None:
    made = fleet(tmp_path, robot("j100-0031", served(f"{{hostname: cpr-j100-0031, {field}}}")))
    assert data(made)["ros"]["servers"] == ["cpr-j100-0031"]
    assert f"#   r1/robot.yaml:4: {why}" in made.text


def test_without_servers_all_hosts_have_one(tmp_path: Path) -> None:
    hosts = ", {hostname: a, ip: 192.168.77.5}"
    made = fleet(tmp_path, robot("j100-0031", "middleware: {discovery: server}", hosts=hosts))
    assert data(made)["ros"]["servers"] == ["cpr-j100-0031", "a"]
    assert "; a file without `servers` has one on each of its hosts (r1/robot.yaml:3); check" in made.text


def test_simple_discovery_is_multicast(tmp_path: Path) -> None:
    simple = "middleware: {discovery: simple, implementation: rmw_cyclonedds_cpp}"
    made = fleet(
        tmp_path, robot("j100-0031", simple), robot("j100-0032", served("{hostname: cpr-j100-0031}"))
    )
    assert data(made)["ros"] == {"distro": "jazzy", "rmw": "cyclonedds", "discovery": "multicast"}
    for key, value, word in (
        ("implementation", "rmw_fastrtps_cpp", "cyclonedds"),
        ("discovery", "server", "multicast"),
    ):
        has = f"r1/robot.yaml:4 has another one, which is `{word}` in a spec"
        assert f"#   r2/robot.yaml:4: {key} {value}; {has}" in made.text
    assert "#   r2/robot.yaml:4: system.ros2.middleware.servers.hostname: a spec has only" in made.text


def test_a_middleware_that_a_spec_has_no_word_for_is_named(tmp_path: Path) -> None:
    made = fleet(tmp_path, robot("j100-0031", "middleware: {implementation: rmw_gurumdds_cpp}"))
    assert data(made)["ros"] == {"distro": "jazzy"}
    assert "r1/robot.yaml:4: implementation: a spec has no word for `rmw_gurumdds_cpp`" in made.text


def test_files_of_two_distributions_are_named(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"a/robot.yaml": HUMBLE, "b/robot.yaml": robot("j100-0032", "")}))
    assert data(made)["ros"] == {"distro": "humble"}
    why = "its hosts are written as files of Jazzy have them; the draft has humble, as a/robot.yaml:3"
    assert f"#   b/robot.yaml:3: {why}" in made.text


def test_a_namespace_that_is_not_the_name_is_kept(tmp_path: Path) -> None:
    found = data(draft(lab(tmp_path, {"robot.yaml": HUMBLE.replace("j100_0001", "lab/J1")})))
    robot_of_it = {"type": "clearpath-j100", "host": "cpr-j100-0001", "namespace": "lab/J1"}
    assert found["robots"] == {"lab-j1": robot_of_it}


def test_another_account_of_a_shared_computer_is_named(tmp_path: Path) -> None:
    base = ", {hostname: base, ip: 192.168.77.5}"
    texts = [robot(f"j100-003{one}", f"username: u{one}", hosts=base) for one in (1, 2)]
    made = fleet(tmp_path, *texts)
    assert data(made)["hosts"]["base"]["user"] == "u1"
    assert "#   r2/robot.yaml:4: username of host `base`; r1/robot.yaml:4 has another one" in made.text


def test_a_host_that_a_file_has_twice_is_named(tmp_path: Path) -> None:
    made = fleet(tmp_path, robot("j100-0031", "", hosts=", {hostname: cpr-j100-0031, ip: 192.168.77.31}"))
    assert list(data(made)["hosts"]) == ["cpr-j100-0031"]
    assert "#   r1/robot.yaml:3: this file has host `cpr-j100-0031` before" in made.text


def test_a_server_of_a_shared_computer_is_of_its_island(tmp_path: Path) -> None:
    base, server = "{hostname: base, ip: 192.168.77.5}", served("{hostname: cpr-j100-0032}")
    second = robot("j100-0032", f"domain_id: 13, {server}").replace("hosts: [", f"hosts: [{base}, ")
    made = fleet(tmp_path, robot("j100-0031", "domain_id: 12", hosts=f", {base}"), second)
    assert data(made)["ros"]["servers"] == ["cpr-j100-0032"]


def test_a_file_without_hosts_beside_another_is_named(tmp_path: Path) -> None:
    made = fleet(tmp_path, robot("j100-0031", ""), "serial_number: a\nsystem: {ros2: {domain_id: 3}}\n")
    assert data(made)["ros"] == {"distro": "jazzy"}
    assert "#   r2/robot.yaml:2: it names no host, so nothing of this file is in the draft" in made.text


FULL = """
serial_number: r100-0001
version: 0
system:
  username: robot
  localhost: pc
  hosts:
    - hostname: pc
      ip: 192.168.131.1
      rack: 7
    - ip: 192.168.131.2
  ros2:
    namespace: r1
    domain_id: 3
    workspaces:
      - /home/robot/ws/setup.bash
      - /home/robot/more/setup.bash
    environment:
      A: b
    middleware:
      implementation: rmw_fastrtps_cpp
      discovery: server
      profile: /etc/fast.xml
      override_server_id: true
      servers:
        - hostname: pc
          port: 11812
          server_id: 5
          enabled: maybe
        - hostname: away
          server_id: 1
        - nothing
  bash: {source: [/a, /b]}
platform:
  controller: ps4
sensors:
  camera:
    - model: c
      ros_parameters: {password: hunter2}
mounts: {bracket: []}
links: {}
extra: 5
"""


def test_no_value_of_a_file_vanishes(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"robot.yaml": FULL}))
    assert vanished(FULL, "robot.yaml", made) == []
    assert "hunter2" not in made.text
    for line in (
        "robot.yaml:16: system.ros2.workspaces: a spec has `workspaces` for each host, by their folders",
        "robot.yaml:23: a spec has no key for system.ros2.middleware.profile",
        "robot.yaml:34: a spec has no key for platform",
        "robot.yaml:42: a spec has no key for extra",
    ):
        assert f"#   {line}\n" in made.text
    assert "key for links" not in made.text


WORDS = [
    *("system", "hosts", "platform", "onboard", "ros2", "username", "namespace", "domain_id", "middleware"),
    *("implementation", "discovery", "servers", "hostname", "ip", "port", "server_id", "enabled", "profile"),
    *("server", "simple", "rmw_cyclonedds_cpp", "pc", "10.0.0.1", "", "a b", "j100-1", "x/y", "~", "<<"),
]
SCALARS, ODD = odd(WORDS)
SERVER = st.one_of(ODD, st.fixed_dictionaries({"hostname": ODD}, optional={"port": ODD, "server_id": ODD}))
MIDDLEWARE = st.fixed_dictionaries(
    {"discovery": st.one_of(st.just("server"), ODD)},
    optional={"implementation": ODD, "servers": st.one_of(st.lists(SERVER, max_size=3), ODD), "profile": ODD},
)
ROS = st.fixed_dictionaries(
    {},
    optional={"namespace": ODD, "domain_id": ODD, "username": ODD, "middleware": st.one_of(MIDDLEWARE, ODD)},
)
HOST = st.fixed_dictionaries({"hostname": ODD, "ip": ODD})
HOSTS = st.lists(HOST, max_size=2).map(lambda others: [{"hostname": "pc", "ip": "10.0.0.1"}, *others])
SYSTEM = st.fixed_dictionaries(
    {"hosts": st.one_of(HOSTS, HOSTS, ODD), "ros2": st.one_of(ROS, ROS, ODD)},
    optional={"username": ODD, "self": ODD},
)
FILE = st.fixed_dictionaries(
    {"serial_number": ODD, "system": st.one_of(SYSTEM, SYSTEM, ODD)},
    optional={"platform": ODD, "version": ODD},
)


@settings(max_examples=60)
@given(st.lists(FILE, min_size=1, max_size=2))
def test_odd_files_are_drafted_or_refused(files: list[object]) -> None:
    texts = [yaml.safe_dump(one, allow_unicode=True) for one in files]
    with tempfile.TemporaryDirectory() as folder, suppress(DraftError):
        made = fleet(Path(folder), *texts)
        assert len(texts) > 1 or vanished(texts[0], "r1/robot.yaml", made) == []


def test_robots_and_launch_files_are_one_draft(tmp_path: Path) -> None:
    """A program in a robot's namespace is its; a host that a file leaves empty has its usual name."""
    text = (
        "serial_number: a200-000{0}\n"
        "system:\n  username: robot\n"
        "  hosts:\n    - hostname:  # your host\n      ip:\n"
        "  ros2: {{namespace: a200_000{0}}}\n"
    )
    group = '<group><push_ros_namespace namespace="a200_0002"/><node pkg="p" exec="e" name="n"/></group>'
    files = {f"r{one}/robot.yaml": text.format(one) for one in (1, 2)}
    files["start.launch.xml"] = f'<launch>{group}<node pkg="p" exec="e" name="m"/></launch>'
    made = draft(lab(tmp_path, files))
    found = data(made)
    assert {name: one["host"] for name, one in found["robots"].items()} == {
        "a200-0001": "cpr-a200-0001",
        "a200-0002": "cpr-a200-0002",
    }
    assert found["programs"]["n"]["robot"] == "a200-0002"
    assert "host" not in found["programs"]["m"]
    for line in (
        "    # address: 192.168.77.11  # fill in: r2/robot.yaml:4 has none\n",
        "    robot: a200-0002  # guess: it has the robot's namespace; its host may start it (start.launch",
        "    # host: cpr-a200-0001  # fill in: the host on which start.launch.xml is started\n",
    ):
        assert line in made.text
