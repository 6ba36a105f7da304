"""Launch files and scripts: robots, programs, hosts and the mode that their masters show."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from swarmctl.importing.recognition import driven_type
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.spec.catalog import load_catalog
from tests.importing.drafts import data, draft, lab
from tests.timing import work_at_most

TYPES = with_protocol(load_catalog().types)


@pytest.mark.parametrize(
    ("package", "executable", "kind"),
    [
        ("newswarm", "koala", "koala"),
        ("khepera3_driver", "driver_node", "khepera3"),
        ("epuck_driver_cpp", "epuck_driver_cpp", "epuck"),
        ("e-puck2_driver", "node.py", "epuck2"),
        ("koala_navigation", "planner", ""),
        ("newswarm", "koala_planner", ""),
        ("rosserial_python", "serial_node.py", ""),
        ("epuck_driver", "koala_follower", ""),
        ("kobuki_node", "kobuki", ""),
    ],
)
def test_a_driver_is_known_by_all_words_of_its_name(package: str, executable: str, kind: str) -> None:
    assert driven_type(package, executable, TYPES) == kind


def script(host: str, master: str, ip: str = "") -> str:
    own = f"export ROS_IP={ip}" if ip else f"export ROS_HOSTNAME={host}"
    return f"export ROS_MASTER_URI=http://{master}:11311\n{own}\n"


SHARED = {"a/env.sh": script("a", "a"), "b/env.sh": script("b", "a")}
INNER = '<launch><arg name="n" /><node pkg="p" type="t" name="$(arg n)" /></launch>'
TALKER = '<launch><node pkg="p" type="t" name="talker" /></launch>'
FKIE = '<launch><node pkg="fkie_mas_sync" type="mas-sync" name="sync" /></launch>'


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({**SHARED, "a/x.launch": TALKER}, {"mode": "leader", "leader": "a"}),
        ({**SHARED, "b/x.launch": TALKER}, {"mode": "central", "hub": "a"}),
        ({**SHARED, "m.launch": FKIE}, {"mode": "central", "hub": "a"}),
        ({"a.sh": script("a", "localhost"), "b.sh": script("b", "b")}, {"mode": "standalone"}),
        ({"a.sh": script("a", "a"), "x.launch": TALKER}, {"mode": "single-minded", "leader": "a"}),
        (
            {"a.sh": script("a", "a"), "b.sh": script("b", "a"), "c.sh": script("c", "c"), "m.launch": FKIE},
            {"mode": "combined", "multimaster": {"packages": "fkie_mas"}},
        ),
        (
            {"setup.sh": "ROS_MASTER_URI=http://a:11311", "b.sh": "ROS_IP=10.0.0.2"},
            {"mode": "central", "hub": "a"},
        ),
    ],
)  # fmt: skip
def test_the_masters_show_the_mode(
    files: Mapping[str, str], expected: Mapping[str, object], tmp_path: Path
) -> None:
    found = data(draft(lab(tmp_path, files)))
    keys = found.keys() & {"mode", "leader", "hub", "multimaster"}
    assert {key: found[key] for key in keys} == expected


def test_hosts_with_one_master_are_an_island(tmp_path: Path) -> None:
    files = {"a.sh": script("a", "a"), "b.sh": script("b", "a"), "c.sh": script("c", "c")}
    islands = data(draft(lab(tmp_path, files)))["islands"]
    assert {name: one["hosts"] for name, one in islands.items()} == {"a": ["a", "b"], "c": ["c"]}


def test_another_port_of_a_master_is_kept(tmp_path: Path) -> None:
    files = {"a.sh": "ROS_MASTER_URI=http://a:11312\nROS_HOSTNAME=a\n"}
    assert data(draft(lab(tmp_path, files)))["hosts"]["a"]["master_port"] == 11312


@pytest.mark.parametrize("value", ["$(hostname -I)", "`hostname`", '"$IP"', "${IP:-10.0.0.1}"])
def test_what_a_shell_computes_is_not_guessed(value: str, tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"a.sh": f"export ROS_HOSTNAME=a\nexport ROS_IP={value}\n"}))
    assert "#   a.sh:2: ROS_IP is computed by the shell" in found.text
    assert data(found)["hosts"] == {"a": {"address": "a"}}


@pytest.mark.parametrize(
    ("files", "hosts", "shown"),
    [
        (
            {"a.sh": "export ROS_MASTER_URI=http://10.0.0.1:11311; export ROS_IP=10.0.0.3 # mine"},
            {"a": {"address": "10.0.0.3"}, "master": {"address": "10.0.0.1"}},
            "",
        ),
        (
            {"a.sh": "export ROS_IP=10.0.0.3 ROS_MASTER_URI='http://10.0.0.1:11311'"},
            {"a": {"address": "10.0.0.3"}, "master": {"address": "10.0.0.1"}},
            "",
        ),
        (
            {"a.sh": "ROS_IP=10.0.0.1\nROS_MASTER_URI=10.0.0.1"},
            {"a": {"address": "10.0.0.1"}},
            "",
        ),
        (
            {
                "k3_env.sh": "ROS_IP=10.0.0.9",
                "m.launch": '<launch><machine name="k3" address="10.0.0.1" user="pi" /></launch>',
            },
            {"k3": {"address": "10.0.0.1", "user": "pi"}},
            "#   k3_env.sh:1: the address 10.0.0.9; m.launch:1 has 10.0.0.1",
        ),
        ({"a.sh": "ROS_IP=10.0.0.1\necho ROS_IP=10.0.0.2 > x"}, {"a": {"address": "10.0.0.1"}}, ""),
    ],
)
def test_scripts_are_read_as_they_are_meant(
    files: Mapping[str, str], hosts: object, shown: str, tmp_path: Path
) -> None:
    found = draft(lab(tmp_path, files))
    assert data(found)["hosts"] == hosts
    assert shown in found.text


@pytest.mark.parametrize(
    ("args", "kept"),
    [
        ("/dev/ttyUSB1 _baud:=115200", ["/dev/ttyUSB1", "_baud:=115200"]),
        ("load pkg/Nodelet 'the manager'", ["load", "pkg/Nodelet", "the manager"]),
        ("0.1 0 0 {a}", ["0.1", "0", "0", "{{a}}"]),
        ("_password:=hunter2", None),
        ("'open", None),
    ],
)
def test_the_words_of_a_node_are_kept(args: str, kept: list[str] | None, tmp_path: Path) -> None:
    node = f'<node pkg="p" type="t" name="n" args="{args}" />'
    found = draft(lab(tmp_path, {"a.sh": "ROS_IP=10.0.0.1", "x.launch": f"<launch>{node}</launch>"}))
    assert data(found)["programs"]["n"].get("args") == kept
    assert ("#   x.launch:1: its args" in found.text) is (kept is None)
    assert "hunter2" not in found.text


def test_a_variable_that_is_set_twice_is_not_guessed(tmp_path: Path) -> None:
    files = {"a.sh": "ROS_HOSTNAME=a\nif x; then\n  ROS_IP=10.0.0.1\nelse\n  ROS_IP=10.0.0.2\nfi\n"}
    assert "#   a.sh:5: ROS_IP is set more than once" in draft(lab(tmp_path, files)).text


def launch(*lines: str) -> Mapping[str, str]:
    text = "\n".join(("<launch>", *lines, "</launch>"))
    return {"a.sh": "ROS_HOSTNAME=a\nROS_IP=10.0.0.1\n", "x.launch": text}


@pytest.mark.parametrize(
    ("port", "link"),
    [
        ("10:00:E8:C5:64:37", {"kind": "bluetooth", "mac": "10:00:e8:c5:64:37"}),
        ("/dev/ttyS0", {"kind": "serial", "device": "/dev/ttyS0"}),
        ("/dev/ttyUSB0", None),
        ("/dev/rfcomm0", None),
    ],
)
def test_a_line_that_keeps_its_name_is_taken(
    port: str, link: Mapping[str, str] | None, tmp_path: Path
) -> None:
    node = f'<node pkg="epuck_driver" type="driver" name="e1"><param name="port" value="{port}" /></node>'
    found = draft(lab(tmp_path, launch(node)))
    assert data(found).get("links") == (link and [{**link, "host": "a", "robot": "e1"}])


def test_parameters_have_the_types_that_roslaunch_gives_them(tmp_path: Path) -> None:
    values = {"a": "20", "b": "0.5", "c": "1e3", "d": "True", "e": "text"}
    params = [f'<param name="{name}" value="{one}" />' for name, one in values.items()]
    params += ['<param name="f" value="7" type="str" />', '<param name="g" value="7" type="double" />']
    found = draft(lab(tmp_path, launch('<node pkg="p" type="t" name="n">', *params, "</node>")))
    wanted = {"a": 20, "b": 0.5, "c": 1000.0, "d": True, "e": "text", "f": "7", "g": 7.0}
    assert data(found)["programs"]["n"]["params"] == wanted


def test_an_argument_without_a_value_is_not_read(tmp_path: Path) -> None:
    text = launch('<arg name="robot" />', '<node pkg="p" type="t" name="$(arg robot)" />')
    assert (
        "#   x.launch:3: the argument `robot` is given when it is launched" in draft(lab(tmp_path, text)).text
    )


def test_an_included_file_is_not_read_twice(tmp_path: Path) -> None:
    outer = '<include file="$(dirname)/inner.launch"><arg name="n" value="{}" /></include>'
    files = {**launch(outer.format("left"), outer.format("right")), "inner.launch": INNER}
    found = draft(lab(tmp_path, files))
    assert list(data(found)["programs"]) == ["left", "right"]
    assert "Not read" not in found.text


def test_a_package_in_the_folder_is_found(tmp_path: Path) -> None:
    argument = '<arg name="n" value="talker" />'
    files = {
        **launch(f'<include file="$(find demo)/launch/d.launch">{argument}</include>'),
        "src/demo/package.xml": "<package><name>demo</name></package>",
        "src/demo/launch/d.launch": INNER,
    }
    found = draft(lab(tmp_path, files))
    assert list(data(found)["programs"]) == ["talker"]
    assert "Not read" not in found.text


HOSTILE = [
    "a: b",
    "x # y",
    'q"uote',
    "new\nline",
    "{a, b}",
    "- list",
    "&anchor",
    "!tag",
    "\u2028",
    "\u202e",
    "%x",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_a_hostile_text_stays_a_text(text: str, tmp_path: Path) -> None:
    from xml.sax.saxutils import quoteattr

    value = quoteattr(text, {"\n": "&#10;"})
    inner = f'<param name={value} value={value} /><env name="E" value={value} />'
    node = f'<node pkg="p" type="t" name={value}>{inner}</node>'
    machine = f"<machine name={value} address={value} user={value} />"
    found = draft(lab(tmp_path, launch(node, machine)))
    assert set(data(found)) <= {
        "version",
        "name",
        "mode",
        "hub",
        "leader",
        "hosts",
        "robots",
        "links",
        "programs",
    }
    (program,) = data(found)["programs"].values()
    assert set(program) <= {"host", "package", "executable", "params", "environment"}


def test_braces_of_a_launch_file_are_no_placeholders(tmp_path: Path) -> None:
    """A text in braces reaches its node as it stands in the launch file, through the placeholders."""
    inner = '<param name="shape" value="{host} {{" /><env name="E" value="{robot}" />'
    found = draft(lab(tmp_path, launch(f'<node pkg="p" type="t" name="n">{inner}</node>')))
    program = data(found)["programs"]["n"]
    assert program["params"] == {"shape": "{{host}} {{{{"}
    assert program["environment"] == {"E": "{{robot}}"}


def test_a_launch_file_above_the_limits_is_named(tmp_path: Path) -> None:
    files = {**launch(), "y.launch": f"<launch>{'<group>' * 100}{'</group>' * 100}</launch>"}
    assert "#   y.launch: it, or all launch files together, are too large" in draft(lab(tmp_path, files)).text


def test_a_password_in_an_address_is_left_out(tmp_path: Path) -> None:
    url = '<param name="stream" value="rtsp://admin:hunter2@10.0.0.9/live" />'
    found = draft(lab(tmp_path, launch(f'<node pkg="p" type="t" name="n">{url}</node>')))
    assert "#   x.launch:2: stream may be a secret" in found.text
    assert "hunter2" not in found.text


def test_too_much_is_named_and_not_read(tmp_path: Path) -> None:
    files = {f"{number:02}.sh": "#" * 250_000 for number in range(18)}
    found = draft(
        lab(tmp_path, {**files, "00.sh": "ROS_HOSTNAME=a\nROS_IP=10.0.0.1\n", "x.sh": "#" * 300_000})
    )
    assert "#   x.sh: it is larger than 256 KiB" not in found.text  # it is beyond the limit on all files
    assert "and what follows, are too many files or too large" in found.text
    (tmp_path / "01.sh").write_text("#" * 300_000)
    assert "#   01.sh: it is larger than 256 KiB" in draft(tmp_path).text


def test_many_machines_are_read_at_once(tmp_path: Path) -> None:
    machines = "".join(f'<machine name="p{n}" address="10.0.{n // 250}.{n % 250}"/>' for n in range(3000))
    folder = lab(tmp_path, {"a.launch": f"<launch>{machines}</launch>"})
    with work_at_most(1000):  # a search through all hosts for each takes minutes
        found = draft(folder)
    assert len(data(found)["hosts"]) == 3000


def test_a_dot_in_the_name_of_a_machine_begins_no_domain(tmp_path: Path) -> None:
    text = '<launch><machine name="lab.a" address="10.0.0.1"/><machine name="lab.b" address="b"/></launch>'
    assert list(data(draft(lab(tmp_path, {"a.launch": text})))["hosts"]) == ["lab-a", "lab-b"]


def test_the_multimaster_shows_several_masters(tmp_path: Path) -> None:
    text = (
        '<launch><machine name="a" address="10.0.0.1"/><machine name="b" address="10.0.0.2"/>'
        '<node pkg="fkie_master_discovery" type="master_discovery" name="d"/></launch>'
    )
    found = data(draft(lab(tmp_path, {"a.launch": text})))
    assert (found["mode"], found["multimaster"]) == ("standalone", {"packages": "fkie_multimaster"})


def test_a_program_may_not_have_a_reserved_name(tmp_path: Path) -> None:
    text = '<launch><machine name="a" address="10.0.0.1"/><node pkg="p" type="e" name="master"/></launch>'
    assert list(data(draft(lab(tmp_path, {"a.launch": text})))["programs"]) == ["node-master"]


DRIVERS = """<launch>
<node pkg="koala_driver" type="koala_node" name="koala"><param name="port" value="/dev/ttyS0"/></node>
<node pkg="epuck_driver" type="epuck_driver" name="e"><param name="id" value="10:00:E8:C5:64:37"/></node>
</launch>"""


def test_a_parameter_that_is_kept_is_not_left_out(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"a.launch": DRIVERS, "env.sh": script("pi", "pi", "10.0.0.1")}))
    assert "device: /dev/ttyS0" in found.text
    assert "Not read" not in found.text


def test_nodes_without_a_computer_are_on_one_to_fill_in(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"a.launch": DRIVERS}))
    assert data(found)["hosts"] == {"robot-pc": {"bluetooth": ["hci0"]}}
    assert {one["host"] for one in data(found)["robots"].values()} == {"robot-pc"}
    assert "# address: 192.168.77.11  # fill in: nothing that is read names a computer" in found.text


def test_what_a_spec_refuses_is_shown_and_to_fill_in(tmp_path: Path) -> None:
    files = {"a.launch": '<launch><machine name="a" address="a" user="no name!"/></launch>'}
    line = next(one for one in draft(lab(tmp_path, files)).text.split("\n") if "no name!" in one)
    assert "from a.launch:1; fill in: " in line


GLOBALS = """\
<launch>
  <param name="/use_sim_time" value="true"/>
  <rosparam param="waypoints">[[0,0],[1,1]]</rosparam>
  <env name="LOG" value="1"/>
  <group ns="r0">
    <param name="speed_limit" value="0.2"/>
    <node pkg="p" type="t" name="n" respawn="true" launch-prefix="nice -n -5" required="true" output="screen"
      args="-d $(find my_lab)/launch/lab.rviz 'a b'"/>
    <node pkg="p" type="t" name="m" if="false"/>
  </group>
  <test pkg="p" type="t" test-name="x"/>
  <master auto="start"/>
</launch>
"""


def test_what_a_spec_has_no_key_for_is_not_read_by_its_line(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"a.launch": GLOBALS}))
    found = data(made)
    assert found["ros"] == {"use_sim_time": True}
    assert found["programs"]["n"]["args"] == ["-d", "$(find my_lab)/launch/lab.rviz", "a b"]
    assert found["programs"]["n"]["environment"] == {"LOG": "1"}
    for line in (
        "3: rosparam /waypoints is of no node; write it as `params` of those that read it",
        "6: speed_limit (0.2) is of no node; write it as `params` of those that read it",
        '7: respawn="true" has no key in a spec: systemd restarts programs',
        '7: required="true" has no key in a spec: the other programs run on',
        '7: launch-prefix="nice -n -5" has no key in a spec; write `command`',
        "7: output of this node and of others: the journal of a host has what its programs print",
        "9: it is not started: its condition is not true",
        "11: a <test> has no counterpart in a spec",
        "12: a <master> has no counterpart in a spec",
    ):
        assert f"#   a.launch:{line}\n" in made.text
