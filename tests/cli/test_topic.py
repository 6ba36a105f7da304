"""``swarmctl topic`` as a person sees it; the hosts' answers are invented."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from swarmctl.cli import exit_codes
from swarmctl.remote import host_commands
from swarmctl.remote.host_commands import Ran
from swarmctl.remote.parallel_hosts import Finished, Note
from swarmctl.remote.transport import HostError, Kind, Target
from tests import ROOT
from tests.in_process import swarmctl

LEADER, ISLANDS, ROS_2 = "paper-leader", "paper-4-standalone", "ros2-2-leader"
CENTRAL_2 = "ros2-3-central"  # its graph does not have the hosts of nodes
AWAY = HostError(Kind.UNREACHABLE, "k3-pi is unreachable: no route to host", "look at `swarmctl status SPEC`")
ODOM = " * /k3/odom [nav_msgs/Odometry] 1 publisher\n"
ROSOUT = " * /rosout [rosgraph_msgs/Log] 3 publishers\n * /rosout [rosgraph_msgs/Log] 1 subscriber\n"
PUB = ("pub", "/k3/cmd_vel", "geometry_msgs/Twist", "{}")


class Hosts:
    """Answers of hosts, and what was sent to them: the host, and the command line of the tool."""

    def __init__(self) -> None:
        self.answers: Mapping[str, Ran] = {}
        self.lines: tuple[str, ...] = ()
        self.sent: list[tuple[str, str]] = []
        self.left = False

    def run(self, targets: list[Target], command: str, *_: Any, **__: Any) -> Iterator[Any]:
        try:
            for one in targets:
                self.sent.append((one.host, command.rpartition("PYTHONUNBUFFERED=1 exec ")[2].rstrip("'")))
                for line in self.lines:
                    yield Note(one.host, line)
                yield Finished(one.host, self.answers.get(one.host, Ran(one.host, 0)), 1.0)
        finally:
            self.left = True


@pytest.fixture
def hosts(monkeypatch: pytest.MonkeyPatch) -> Hosts:
    found = Hosts()
    monkeypatch.setattr(host_commands, "run", found.run)
    return found


def topic(folder: Path, example: str, *words: str) -> Any:
    shutil.copy(ROOT / "examples" / example / "swarm.yaml", folder)
    return swarmctl("topic", *words, cwd=folder)


def test_a_list_merges_equal_islands(hosts: Hosts, tmp_path: Path) -> None:
    hosts.answers = {
        "koala-laptop": Ran("koala-laptop", 0, ROSOUT.encode()),
        "k3-pi": Ran("k3-pi", 0, (ODOM + ROSOUT).encode()),
        "epuck-pi": Ran("epuck-pi", 1, b"", b"ERROR: Unable to communicate with master!\n"),
    }
    done = topic(tmp_path, ISLANDS, "list")
    assert [line.strip().split(maxsplit=4) for line in done.stdout.splitlines()] == [
        ["TOPIC", "TYPE", "PUBLISHERS", "SUBSCRIBERS", "ISLANDS"],
        ["/k3/odom", "nav_msgs/Odometry", "1", "0", "k3-pi"],
        ["/rosout", "rosgraph_msgs/Log", "3", "1", "koala-laptop, k3-pi"],
    ]
    message = "failed: epuck-pi: exit code 1: ERROR: Unable to communicate with master!"
    assert done.stderr.splitlines()[-1] == message
    assert done.returncode == exit_codes.HOSTS_FAILED
    assert hosts.sent[0] == ("koala-laptop", "rostopic list -v")


def test_json_has_every_island(hosts: Hosts, tmp_path: Path) -> None:
    hosts.answers = {"k3-pi": Ran("k3-pi", None, error=AWAY), "epuck-pi": Ran("epuck-pi", 0, ODOM.encode())}
    done = topic(tmp_path, ISLANDS, "list", "--json")
    odom = {"island": "epuck-pi", "type": "nav_msgs/Odometry", "publishers": 1, "subscribers": 0}
    error = {"kind": "unreachable", "message": AWAY.message, "hint": AWAY.hint}
    assert json.loads(done.stdout) == {
        "v": 1,
        "swarm": "newswarm",
        "topics": [{"topic": "/k3/odom", "islands": [odom]}],
        "errors": [{"island": "k3-pi", **error}],
    }
    assert done.returncode == exit_codes.HOSTS_UNREACHABLE


@pytest.mark.parametrize(
    ("example", "words", "sent"),
    [
        (LEADER, ("/k3/odom",), "koala-laptop"),
        (LEADER, ("swarm.yaml", "map"), "koala-laptop"),
        (LEADER, ("/k3/odom", "--host", "epuck-pi"), "epuck-pi"),
        (ISLANDS, ("//k3/odom/pose",), "k3-pi"),
        (ISLANDS, ("/k3/odom", "--island", "epuck-pi"), "epuck-pi"),
        (ISLANDS, ("/map", "--host", "epuck-pi"), "epuck-pi"),
    ],
)
def test_it_runs_on_the_hub_of_the_topics_island(
    hosts: Hosts, tmp_path: Path, example: str, words: tuple[str, ...], sent: str
) -> None:
    assert topic(tmp_path, example, "hz", *words).returncode == 0
    assert [host for host, _ in hosts.sent] == [sent]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("/map",), "name one by --island: koala-laptop, k3-pi, epuck-pi"),
        (("/k33/odom",), "name one by --island: koala-laptop, k3-pi, epuck-pi"),
        (("/k3/odom", "--island", "x"), "the islands are: `epuck-pi`, `k3-pi`, `koala-laptop`"),
        (("/k3/odom", "--host", "x"), "the hosts are: `epuck-pi`, `k3-pi`, `koala-laptop`"),
        (("/k3/odom", "--island", "k3-pi", "--host", "epuck-pi"), "island k3-pi has: `k3-pi`"),
    ],
)
def test_an_unknown_island_is_a_usage_error(
    hosts: Hosts, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    done = topic(tmp_path, ISLANDS, "echo", *words)
    assert message in done.stderr
    assert (done.returncode, hosts.sent) == (exit_codes.USAGE, [])


def test_lines_are_escaped_and_keep_their_stream(hosts: Hosts, tmp_path: Path) -> None:
    hosts.lines = ("data: \x1b[2J", "! WARNING: \x07")
    hosts.answers = {"koala-laptop": Ran("koala-laptop", 9)}
    done = topic(tmp_path, LEADER, "echo", "/k3/odom")
    assert (done.stdout, done.stderr) == ("data: \\x1b[2J\n", "WARNING: \\x07\n")
    assert done.returncode == 9


def test_echo_ends_after_n_messages(hosts: Hosts, tmp_path: Path) -> None:
    hosts.lines = ("x: 1", "---", "x: 2", "---", "x: 3", "---")
    hosts.answers = {"koala-laptop": Ran("koala-laptop", 9)}
    done = topic(tmp_path, LEADER, "echo", "/k3/odom", "-n", "2")
    assert (done.stdout, done.returncode, hosts.left) == ("x: 1\n---\nx: 2\n---\n", 0, True)


@pytest.mark.parametrize(
    ("ran", "message", "code"),
    [
        (Ran("koala-laptop", 127), "error: koala-laptop has no `rclpy`", exit_codes.HOSTS_FAILED),
        (Ran("koala-laptop", 127), "the Debian package is `ros-jazzy-rclpy`", exit_codes.HOSTS_FAILED),
        (Ran("koala-laptop", 126), "help: `swarmctl deploy` brings one", exit_codes.HOSTS_FAILED),
        (Ran("koala-laptop", None, error=AWAY), "no route to host", exit_codes.HOSTS_UNREACHABLE),
    ],
)
def test_what_a_host_lacks_is_named(hosts: Hosts, tmp_path: Path, ran: Ran, message: str, code: int) -> None:
    hosts.answers = {"koala-laptop": ran}
    done = topic(tmp_path, ROS_2, "hz", "/k3/odom")
    assert message in done.stderr
    assert done.returncode == code


@pytest.mark.parametrize(
    ("example", "more", "printed"),
    [
        (LEADER, (), "note: k3 obeys its commander koala-laptop, and so this tool on koala-laptop"),
        (LEADER, ("--host", "k3-pi"), "warning: k3 will ignore this: by `control` it obeys koala-laptop"),
        (ROS_2, (), "warning: k3 will ignore this: by `control` it obeys joystick"),
        (CENTRAL_2, ("--host", "k3-pi"), "warning: k3 will ignore this: by `control` it obeys square, k3-pi"),
    ],
)
def test_pub_says_whether_the_robot_obeys(
    hosts: Hosts, tmp_path: Path, example: str, more: tuple[str, ...], printed: str
) -> None:
    done = topic(tmp_path, example, *PUB, "--rate", "10", *more)
    assert done.stderr.splitlines()[-1].startswith(printed)
    assert done.returncode == 0
    kind = "geometry_msgs/msg/Twist" if example.startswith("ros2") else "geometry_msgs/Twist"
    assert f"pub -r 10 -- /k3/cmd_vel {kind} " in hosts.sent[0][1]


def test_pub_on_another_topic_says_nothing(hosts: Hosts, tmp_path: Path) -> None:
    done = topic(tmp_path, LEADER, "pub", "/k3/leds", "std_msgs/UInt8MultiArray", "{}", "--once")
    assert "obey" not in done.stderr


def test_pub_leaves_a_type_without_its_package_to_the_host(hosts: Hosts, tmp_path: Path) -> None:
    assert topic(tmp_path, ROS_2, "pub", "/k3/leds", "Twist", "{}").returncode == 0
    assert "pub -- /k3/leds Twist " in hosts.sent[0][1]


def burger(folder: Path, more: str = "") -> Path:
    """A spec whose k3 has a vendor's driver, with ``more`` in its entry."""
    lines = (ROOT / "examples" / LEADER / "swarm.yaml").read_text().splitlines()
    spec = "\n".join(one for one in lines if "robot: k3" not in one)
    path = folder / "burger.yaml"
    path.write_text(spec.replace("type: khepera3", f"type: turtlebot3-burger{more}"))
    return path


def test_pub_warns_where_nothing_checks_commanders(hosts: Hosts, tmp_path: Path) -> None:
    driver = "{package: burger, executable: drive, ungated: true, reason: the lab is empty}"
    done = swarmctl("topic", *PUB[:1], str(burger(tmp_path, f", driver: {driver}")), *PUB[1:])
    assert "warning: k3 obeys whoever publishes here: nothing checks who commands it" in done.stderr
    assert len(hosts.sent) == 1


def test_pub_does_not_pass_by_a_gate(hosts: Hosts, tmp_path: Path) -> None:
    words = ("/k3//gate/cmd_vel", "geometry_msgs/Twist", "{}")
    done = swarmctl("topic", "pub", str(burger(tmp_path)), *words)
    assert "only the gate of k3 publishes on /k3/gate/cmd_vel" in done.stderr
    assert "commands for k3 go to /k3/cmd_vel" in done.stderr
    assert hosts.sent == []


def test_rate_and_once_exclude_each_other(hosts: Hosts, tmp_path: Path) -> None:
    assert topic(tmp_path, LEADER, *PUB, "--rate", "1", "--once").returncode == exit_codes.USAGE
