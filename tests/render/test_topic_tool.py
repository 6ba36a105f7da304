"""The commands for topics as a host's shell gets them, and what their lists say."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from swarmctl.render import topic_tool
from swarmctl.render.middleware import middleware_of
from swarmctl.render.topic_tool import NO_RELEASE, NO_TOOL, Listed, TopicTool, listed, sent

LONGEST_ARGUMENT = 100_000  # bytes; Linux takes 128 KiB, and SSH adds some
TWIST = "{linear: {x: 0.1}}"
SHOW = TopicTool((sys.executable, "-c", "import json, sys; print(json.dumps(sys.argv[1:]))"), "json")
PRINTED = """\

Published topics:
 * /k3/odom [nav_msgs/Odometry] 1 publisher
 * /rosout [rosgraph_msgs/Log] 3 publishers

Subscribed topics:
 * /rosout [rosgraph_msgs/Log] 1 subscriber
 * /k3/cmd_vel [geometry_msgs/msg/Twist, geometry_msgs/msg/TwistStamped] 2 subscribers

"""


COMMANDS = [
    "list -v",
    "echo /k3/odom",
    "hz /k3/odom",
    "pub -r 10 -- /a T '{linear: {x: 0.1}}'",
    "pub -1 -- /a T '{linear: {x: 0.1}}'",
    "pub -- /a T '{linear: {x: 0.1}}'",
]


@pytest.mark.parametrize("distro", ["noetic", "jazzy"])
def test_the_commands_are_those_of_ros(distro: str) -> None:
    tool = middleware_of(distro).topic_tool
    words = [tool.list(), tool.echo("/k3/odom"), tool.hz("/k3/odom")]
    published = [(10.0, False), (None, True), (None, False)]
    words += [tool.pub("/a", "T", TWIST, rate=rate, once=once) for rate, once in published]
    assert [shlex.join(one[len(tool.words) :]) for one in words] == COMMANDS


def test_ros_1_has_its_own_tool() -> None:
    assert middleware_of("noetic").topic_tool.words == ("rostopic",)


def test_a_program_that_is_sent_fits_into_a_command_and_runs(
    release: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """This Python has no rclpy: the program is imported, and ends with one line."""
    monkeypatch.setattr(topic_tool, "ROOT", str(release))
    tool = TopicTool(sent("swarm_onboard.ros2_tools.topic"), "json")
    line = tool.line("lab", tool.list())
    assert len(line) < LONGEST_ARGUMENT
    done = subprocess.run(["/bin/sh", "-c", line], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "error: No module named 'rclpy'\n")


@pytest.fixture(scope="module")
def release(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a swarm `lab` with a release that sets a variable."""
    root = tmp_path_factory.mktemp("opt")
    (root / "lab/current").mkdir(parents=True)
    (root / "lab/current/setup.bash").write_text('export PEBBLE="$*"\n')
    return root


def status_and_output(line: str, **variables: str) -> tuple[int, str]:
    done = subprocess.run(
        ["/bin/sh", "-c", line], capture_output=True, text=True, check=False, env={**os.environ, **variables}
    )
    return done.returncode, done.stdout


@settings(max_examples=20, deadline=None)
@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=30))
@example("$(exit 9)'\"\\`exit 8`\n; exit 7 #")
@example("-x --extend")
def test_hostile_names_stay_one_word(release: Path, text: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(topic_tool, "ROOT", str(release))
        words = SHOW.pub(f"/{text}", text, text, rate=None, once=False)
        status, output = status_and_output(SHOW.line("lab", words))
    assert (status, json.loads(output)) == (0, ["pub", "--", f"/{text}", text, text])


def test_it_runs_in_the_ros_of_the_release(release: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(topic_tool, "ROOT", str(release))
    line = SHOW.line("lab", ("printenv", "PEBBLE", "PYTHONUNBUFFERED"))
    assert status_and_output(line, PEBBLE="no") == (0, "\n1\n"), "the file gets no arguments"


def test_a_host_that_lacks_something_has_its_own_code(release: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(topic_tool, "ROOT", str(release))
    assert status_and_output(SHOW.line("other", SHOW.list())) == (NO_RELEASE, "")
    missing = TopicTool(("true",), "pebble_topic")
    assert status_and_output(missing.line("lab", missing.list())) == (NO_TOOL, "")


def test_a_list_has_types_and_counts() -> None:
    assert list(listed(PRINTED)) == [
        Listed("/k3/cmd_vel", "geometry_msgs/msg/Twist, geometry_msgs/msg/TwistStamped", 0, 2),
        Listed("/k3/odom", "nav_msgs/Odometry", 1, 0),
        Listed("/rosout", "rosgraph_msgs/Log", 3, 1),
    ]
