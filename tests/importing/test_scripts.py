"""What the scripts of a lab set and start, on which computers."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.importing.drafting import DraftError
from swarmctl.importing.shell_script import Assignment, Command, read_script
from swarmctl.ros_packages.launch_values import Unknown
from tests.importing.drafts import data, draft, lab

FLEET = """\
#!/bin/bash
for i in 1 2; do
  ssh -f -l pi robot-0$i.local "export ROS_MASTER_URI=http://desk.local:11311; \
export ROS_HOSTNAME=robot-0$i.local; \
ROS_NAMESPACE=robot_0$i roslaunch turtlebot3_bringup turtlebot3_robot.launch multi_robot_name:=robot_0$i"
done
"""


def commands(text: str, **others: str) -> list[tuple[str, str]]:
    """The commands of a script, each behind its account and computer."""
    texts = {"start.sh": text, **{name.replace("__", "."): one for name, one in others.items()}}
    found: list[tuple[str, str]] = []
    for one in read_script("start.sh", texts).steps:
        if isinstance(one, Command) and one.words != ("ssh",):
            remote = f"{one.remote.user}@{one.remote.address}".lstrip("@") if one.remote else ""
            words = ("?" if isinstance(word, Unknown) else word for word in one.words)
            found.append((remote, " ".join(words)))
    return found


def test_robots_that_a_loop_starts_by_ssh_are_hosts_and_robots(tmp_path: Path) -> None:
    found = data(draft(lab(tmp_path, {"start.sh": FLEET})))
    assert found["hosts"] == {
        "robot-01": {"address": "robot-01.local", "user": "pi"},
        "robot-02": {"address": "robot-02.local", "user": "pi"},
        "desk": {"address": "desk.local"},
    }
    assert (found["mode"], found["hub"]) == ("central", "desk")
    assert {name: (one["type"], one["host"]) for name, one in found["robots"].items()} == {
        "robot-01": ("turtlebot3-burger", "robot-01"),
        "robot-02": ("turtlebot3-burger", "robot-02"),
    }


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("for h in a b; do ssh pi@$h go; done", [("pi@a", "go"), ("pi@b", "go")]),
        ("H=(a b)\nfor h in \"${H[@]}\"; do ssh $h go; done", [("a", "go"), ("b", "go")]),
        ("H='a b'\nfor h in $H; do ssh $h go; done", [("a", "go"), ("b", "go")]),
        ("for i in {1..2}; do ssh r$i go; done", [("r1", "go"), ("r2", "go")]),
        ("for i in $(seq 1 2); do ssh h$((i + 10)) go; done", [("h11", "go"), ("h12", "go")]),
        ("for ((i=1; i<=2; i++)); do ssh r$i go; done", [("r1", "go"), ("r2", "go")]),
        ("go() { ssh $1 \"go $2\"; }\ngo a x\ngo b y", [("a", "go x"), ("b", "go y")]),
        ("ssh a <<EOF\ngo\nEOF", [("a", "go")]),
        ("U=pi\nssh a <<EOF\ngo $U\nEOF", [("a", "go pi")]),
        ("ssh a <<'EOF'\ngo $U\nEOF", [("a", "go ?")]),
        ("ssh a 'bash -s' < there.sh", [("a", "there")]),
        ("ssh -p 2222 -i key -tt pi@a -- go", [("pi@a", "-- go")]),
        ("sshpass -p hunter2 ssh a sudo -E go", [("a", "go")]),
        ("ssh ssh://pi@a:2222 go", [("pi@a", "go")]),
        ("ssh a \"ssh b 'go'\"", [("b", "go")]),
        ("tmux new-session -d -s x 'ssh a go'", [("a", "go")]),
        ("tmux new -d -s x \\; send-keys 'ssh a go' C-m", [("a", "go")]),
        ("tmux send-keys -t x:0 'ssh a' C-m\ntmux send-keys -t x:0 'go' Enter\ntmux send -t y go C-m",
         [("a", "go"), ("", "go")]),
        ("byobu new-window -n a \"ssh a go\"", [("a", "go")]),
        ("screen -dmS x ssh a go", [("a", "go")]),
        ("gnome-terminal --tab -e 'ssh a go' --tab -e 'ssh b go'", [("a", "go"), ("b", "go")]),
        ("gnome-terminal -- bash -c 'ssh a \"go; exec bash\"'", [("a", "go")]),
        ("xterm -e 'ssh a go' &", [("a", "go")]),
        ("source there.sh", [("", "there")]),
        ("./there.sh", [("", "there")]),
        ("bash -c 'ssh a go'", [("a", "go")]),
        ("A=x env B=y go", [("", "go")]),
        ("sshpass -p x\nssh a go", [("a", "go")]),
        ("start() { ssh a go; }", [("a", "go")]),
        ("ssh a\ncat <<EOF\nros2 run p e\nEOF", [("", "cat")]),
        ("echo ${#H[@]} ${H%}\nssh a go", [("", "echo ? ?"), ("a", "go")]),
        ("ssh $ROBOT go", [("", "ssh ? go")]),
        ("ros2 launch {{ folder }}/a.py", [("", "ros2 launch ?")]),
        ("gosu $USER bash -c \"ssh a go\"", [("a", "go")]),
        ("ssh a \"go $1\"", [("a", "?")]),
    ],
)  # fmt: skip
def test_what_a_script_runs(text: str, expected: list[tuple[str, str]]) -> None:
    assert commands(text, there__sh="there") == expected


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("A=1\nX=a$A", "a1"),
        ("A=1\nexport X=\"${A}b\"", "1b"),
        ("X=$((2 + 3))", "5"),
        ("A='p q'\nX=\"$A r\"", "p q r"),
        ("X='$A'", "$A"),
        ("X=\"\\$A\"", "$A"),
    ],
)  # fmt: skip
def test_the_value_of_a_variable(text: str, value: str) -> None:
    steps = [one for one in read_script("a.sh", {"a.sh": text}).steps if isinstance(one, Assignment)]
    assert {one.name: one.value for one in steps}["X"] == value


@pytest.mark.parametrize("text", ["X=$(id -u)", "X=$A", "X=${A:-1}", "X=$((A * 2))", "X=${A##*/}"])
def test_what_the_shell_computes_is_unknown(text: str) -> None:
    (one,) = read_script("a.sh", {"a.sh": text}).steps
    assert isinstance(one, Assignment)
    assert isinstance(one.value, Unknown)


@pytest.mark.parametrize(
    "text",
    [
        "(" * 50_000,
        "x=\"" + "$(" * 5_000,
        "f() { f; f; }; f",
        "source a.sh; source a.sh",
        "for i in {1..999999}; do for j in {1..999999}; do for k in {1..999}; do x; done; done; done",
        "ssh a \"ssh b \\\"ssh c 'eval eval eval x'\\\"\"",
        "a='" + "{1,2}" * 500 + "'; echo {1,2}" + "{1,2}" * 500,
    ],
)  # fmt: skip
def test_a_hostile_script_has_an_end(text: str) -> None:
    assert len(read_script("a.sh", {"a.sh": text}).steps) <= 20_000


PIECES = [
    *("ssh a ", "'", '"', "$(", ")", "${H[@]}", "for i in ", "; do ", "; done", "<<E\n", "\nE\n", "{1..3}"),
    *("tmux send-keys ", "export A=", "$A", "ros2 run p e ", "--ros-args -r ", "if x; then ", "fi", "\\"),
    *(
        "f() { ",
        "}",
        "\n",
        "sshpass -p x ",
        "screen -X stuff ",
        "xterm -e ",
        "roslaunch ",
        "a:=b ",
        "for ((i=0;",
    ),
]


@settings(max_examples=100)
@given(st.lists(st.one_of(st.sampled_from(PIECES), st.text(max_size=3)), max_size=12))
def test_an_odd_script_is_drafted_or_refused(pieces: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder, suppress(DraftError):
        draft(lab(Path(folder), {"a.sh": f"ssh pi@b ros2 run p e\n{''.join(pieces)}"}))


NODES = """\
source /opt/ros/humble/setup.bash
export TURTLEBOT3_MODEL=burger ROS_DOMAIN_ID=30
ros2 run demo talker --rate 2 --ros-args -r __ns:=/tb_1 -r __node:=chat -r chatter:=/talk -p use:=true
ros2 launch nav2_bringup bringup_launch.py map:=/maps/a.yaml
ros2 launch here robots.launch.py name:=tb_9
ros2 topic pub /cmd_vel geometry_msgs/msg/Twist
ssh ubuntu@192.168.77.21 "python3 ~/camera.py; fastdds discovery -i 0"
"""
HERE = """\
<launch>
  <arg name="name" default="tb_0"/>
  <node pkg="demo" exec="base" name="$(var name)"/>
</launch>
"""


def test_what_scripts_start_are_programs(tmp_path: Path) -> None:
    files = {
        "start.sh": NODES,
        "here/package.xml": "<package><name>here</name></package>",
        "here/launch/robots.launch.py": "",
        "here/launch/robots.launch.xml": HERE,
    }
    files["start.sh"] = NODES.replace("robots.launch.py", "robots.launch.xml")
    made = draft(lab(tmp_path, files))
    found = data(made)
    assert found["ros"] == {"distro": "humble", "domain": 30, "servers": ["host-192-168-77-21"]}
    assert found["hosts"] == {"host-192-168-77-21": {"address": "192.168.77.21", "user": "ubuntu"}}
    on: dict[str, Any] = {"host": "host-192-168-77-21"}
    environment = {"environment": {"TURTLEBOT3_MODEL": "burger"}}
    assert found["programs"] == {
        "chat": {
            **on, "package": "demo", "executable": "talker", "args": ["--rate", "2"], "params": {"use": True},
            "remap": {"chatter": "/talk"}, **environment, "namespace": "tb_1",
        },
        "tb-9": {**on, "package": "demo", "executable": "base"},
        "bringup": {
            **on, "package": "nav2_bringup", "launch": "bringup_launch.py", "args": {"map": "/maps/a.yaml"},
            **environment,
        },
    }  # fmt: skip
    assert "#   start.sh:6: `ros2 topic pub /cmd_vel geometry_msgs/msg/Twist` is no launch file" in made.text
    assert "#   start.sh:7: `python3 ~/camera.py` is no launch file and no node" in made.text


def test_hosts_with_different_domains_are_islands(tmp_path: Path) -> None:
    text = """\
for i in 1 2; do
  ssh pi@10.0.0.$i "export ROS_DOMAIN_ID=1$i; ros2 run p e"
done
"""
    found = data(draft(lab(tmp_path, {"start.sh": text})))
    assert (found["mode"], found["ros"]["domain"]) == ("combined", 11)
    assert {name: one["hosts"] for name, one in found["islands"].items()} == {
        "domain-11": ["host-10-0-0-1"],
        "domain-12": ["host-10-0-0-2"],
    }


def test_no_secret_of_a_script_is_copied(tmp_path: Path) -> None:
    text = "sshpass -p hunter2 ssh pi@r1 'ros2 run p e --password hunter2; x --token hunter2'\n"
    made = draft(lab(tmp_path, {"start.sh": f"export API_KEY=hunter2\n{text}ros2 run a b\n"}))
    assert "hunter2" not in made.text
    assert made.text.count("secret") == 4


UNIT = """\
[Unit]
Description=Robot
[Service]
Environment="ROS_DOMAIN_ID=7" RMW_IMPLEMENTATION=rmw_cyclonedds_cpp
ExecStart=-/bin/bash -c 'source /opt/ros/jazzy/setup.bash && \\
  ros2 launch bringup robot.launch.py speed:=0.4'
ExecStop=/bin/kill $MAINPID
"""


def test_a_unit_of_systemd_is_a_script(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"robot.service": UNIT}))
    found = data(made)
    assert found["ros"] == {"distro": "jazzy", "domain": 7, "rmw": "cyclonedds"}
    assert found["programs"]["robot"]["args"] == {"speed": "0.4"}
    assert "robot:  # from robot.service:6" in made.text


IMAGE = """\
FROM ros:humble-ros-base
ENV ROS_DOMAIN_ID 5
ENV RMW_IMPLEMENTATION=rmw_fastrtps_cpp DSN="me:hunter2@db"
RUN ros2 pkg list
CMD ["ros2", "launch", "bringup", "robot.launch.py"]
"""


def test_a_dockerfile_has_the_distribution_and_variables(tmp_path: Path) -> None:
    files = {"Dockerfile": IMAGE, "start.sh": "ros2 run p e\n"}
    made = draft(lab(tmp_path / "image", files))
    assert data(made)["ros"] == {"distro": "humble", "domain": 5, "rmw": "fastrtps"}
    assert (
        "#   Dockerfile:5: `CMD ros2 launch bringup robot.launch.py` is what a container of this image runs"
        in made.text
    )
    assert "#   Dockerfile:3: `ENV DSN` is of the image, and stays in it" in made.text
    assert "hunter2" not in made.text
    compose = "services:\n  a: {image: ros, command: ros2 run p e, environment: [ROS_DOMAIN_ID=6]}\n"
    made = draft(lab(tmp_path / "both", {**files, "compose.yaml": compose}))
    assert data(made)["ros"]["domain"] == 6
    assert "#   Dockerfile:2: ROS_DOMAIN_ID has another value than in compose.yaml:2" in made.text


def test_a_recording_is_a_program(tmp_path: Path) -> None:
    text = "ros2 bag record -o /tmp/run /scan\nros2 topic list\n"
    made = draft(lab(tmp_path, {"start.sh": text}))
    command = ["ros2", "bag", "record", "-o", "/tmp/run", "/scan"]
    assert data(made)["programs"]["rosbag"]["command"] == command
    assert "#   start.sh:2: `ros2 topic list` is no launch file and no node" in made.text


TMUXP = """\
session_name: rover
environment: {ROS_DOMAIN_ID: 3}
shell_command_before: source /opt/ros/humble/setup.bash
windows:
  - window_name: main
    panes:
      - shell_command:
          - ssh pi@rover.local
          - cmd: ros2 run p on_rover
            enter: false
      - ros2 run p here
      - null
"""
TMUXINATOR = """\
name: rover
pre_window: export ROS_DOMAIN_ID=3
windows:
  - main:
      layout: tiled
      panes:
        - ssh pi@rover.local "ros2 run p on_rover"
        - - cd /tmp
          - |
            ros2 run p here
  - log: htop
"""


@pytest.mark.parametrize(("text", "lines"), [(TMUXP, (9, 11)), (TMUXINATOR, (7, 10))])
def test_a_session_of_tmux_is_a_script(text: str, lines: tuple[int, int], tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"session.yaml": text}))
    found = data(made)
    assert found["hosts"]["rover"] == {"address": "rover.local", "user": "pi"}
    assert found["programs"]["on-rover"]["host"] == "rover"
    assert found["ros"]["domain"] == 3
    assert f'(session.yaml:{lines[0]}, "on_rover" there)' in made.text
    assert f"(session.yaml:{lines[1]})" in made.text


@pytest.mark.parametrize(
    "text",
    [
        'HERE=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)\n. $HERE/env.sh',
        'HERE="$( cd "$( dirname "$0" )/../bin" &> /dev/null && pwd )"\n. "$HERE"/env.sh',
        '. $(dirname "$0")/env.sh',
    ],
)
def test_a_script_knows_its_folder(text: str) -> None:
    texts = {"bin/start.sh": text, "bin/env.sh": "ros2 run p e"}
    found = read_script("bin/start.sh", texts)
    assert [one.words for one in found.steps if isinstance(one, Command)] == [("ros2", "run", "p", "e")]


def test_a_python_program_that_starts_others_is_named(tmp_path: Path) -> None:
    program = "import subprocess\nsubprocess.run(['ssh', 'pi@r', 'ros2 launch p x.launch.py'])\n"
    made = draft(
        lab(tmp_path, {"start.sh": "ros2 run p e\n", "run.py": program, "node.py": "import rclpy\n"})
    )
    assert "#   run.py:2: a Python program that has `ssh`; it is not read" in made.text
    assert "node.py" not in made.text
    scan = "import subprocess\nROBOTS = {'A1': 'c0:4b:24:02:a8:9b'}\n"
    made = draft(lab(tmp_path / "scan", {"start.sh": "ros2 run p e\n", "scan.py": scan}))
    assert "#   scan.py:2: a Python program that has `c0:4b:24:02:a8:9b`; it is not read" in made.text


ERB = """\
<%
if @settings["sim"]
  kind = 1
end
%>
root: ./
windows:
  - drivers:
      panes:
        - ros2 launch p always.launch.py namespace:=<%= ns %> rate:=5
        <%- if sim %>
        - ros2 run p sim
        <%- else %>
        - ros2 run p real
        <%- end %>
"""


def test_what_ruby_decides_in_a_session_is_to_fill_in(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"session.yml": ERB, "$.sh": "ros2 launch p b.launch.py speed:=$1 rate:=6\n"}))
    programs = data(made)["programs"]
    assert {name: one["args"] for name, one in programs.items()} == {
        "b": {"rate": "6"},
        "always": {"rate": "5"},
    }
    for line in (
        "#   session.yml:10: `argument namespace` depends on a template\n",
        "#   $.sh:1: `argument speed` depends on the variable `$1`\n",
        "# sim: {host: robot-pc, package: p, executable: sim}  # fill in: session.yml:12: whether it",
        "# real: {host: robot-pc, package: p, executable: real}  # fill in: session.yml:14: whether it",
    ):
        assert line in made.text


OPTIONS = """\
ROBOTS=("10.0.0.1" "10.0.0.2")
while [[ $# -gt 0 ]]; do
  case $1 in
    -r) ROBOTS=(); shift; while [[ $# -gt 0 ]]; do ROBOTS+=("$1"); shift; done;;
  esac
done
for i in $(seq 1 ${#ROBOTS[@]}); do
  ssh me@${ROBOTS[$((i-1))]} "ros2 run p robot_$i"
done
"""


def test_a_script_without_options_has_its_defaults(tmp_path: Path) -> None:
    found = data(draft(lab(tmp_path, {"start.sh": OPTIONS})))
    assert [(one["address"], one["user"]) for one in found["hosts"].values()] == [
        ("10.0.0.1", "me"),
        ("10.0.0.2", "me"),
    ]
    assert [one["executable"] for one in found["programs"].values()] == ["robot_1", "robot_2"]


def test_a_remote_text_of_several_words_has_its_lines(tmp_path: Path) -> None:
    text = 'ssh me@10.0.0.1 """\n  echo "a b"\n  ros2 run p e\n"""\n'
    assert "(start.sh:3)" in draft(lab(tmp_path, {"start.sh": text})).text
