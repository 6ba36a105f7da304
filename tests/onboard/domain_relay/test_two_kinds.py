"""The relay between a real master with nodes of rospy, and a domain with nodes of rclpy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from tests.onboard.gate.ros_host import run_isolated

pytestmark = pytest.mark.lab
DISTRO = "jazzy"
DRIVER, BRAIN, RELAY = "/koala/driver", "/tb/brain", "/multimaster_tb"


@pytest.fixture(scope="module")
def found() -> Any:
    """What `two_kinds.py` prints, if this machine can have the images of both kinds of ROS."""
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
        images = [image.ensure(lambda _line: None, distro=distro) for distro in ("", DISTRO)]
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    return run_isolated(Path(__file__).with_name("two_kinds.py"), *images, DISTRO)


def test_latched_messages_cross_both_ways_to_late_subscribers(found: Any) -> None:
    assert found["latched"] == [["north"], ["attic"], BRAIN]


def test_a_topic_of_both_islands_makes_no_loop(found: Any) -> None:
    """Each of 20 messages from both sides arrives once."""
    assert found["times at driver"] == found["times at brain"] == [[1], 40]


def test_senders_keep_their_names(found: Any) -> None:
    """A driver decides by them whose commands count."""
    assert found["authority"] == BRAIN
    assert found["names"] == [DRIVER]


def test_a_command_latched_before_the_relay_is_left_out(found: Any) -> None:
    assert found["drive"] == [2.0]


def test_the_stamp_of_a_header_is_kept(found: Any) -> None:
    assert found["stamp"] == 1234


def test_an_undeclared_topic_stays_on_its_island(found: Any) -> None:
    assert found["undeclared"] == [["secret 1"], ["secret 2"], [DRIVER]]


def test_a_publisher_whose_type_differs_is_reported(found: Any) -> None:
    level, message, lines = found["type differs"]
    assert level == 2
    assert "/odd of /odd: its type is 'std_msgs/String'" in message
    assert lines["koala /odd"] == "nobody publishes it"


def test_the_report_has_the_senders_of_both_directions(found: Any) -> None:
    _, _, lines = found["type differs"]
    assert lines["koala /odom"] == DRIVER
    assert lines["koala gets /cmd_vel"] == BRAIN


def test_a_master_that_hangs_or_answers_garbage_costs_no_other(found: Any) -> None:
    """Both are peers all the time."""
    _, message, _ = found["type differs"]
    assert message.startswith(
        "1 of 3 peers connected; hangs: no answer within 2 s; garbage: the answer is not"
    )


def test_a_name_that_a_node_of_ros_1_has_is_not_taken(found: Any) -> None:
    """The master would shut that node down."""
    assert found["clash"] == [True, None]
    level, message, lines = found["clash report"]
    assert level == 1
    assert "refused /cmd_vel of /clash: a node of that name runs there, at http://127.0.0.1:" in message
    assert lines["koala gets /cmd_vel"] == BRAIN


def test_a_publisher_on_a_host_of_another_island_is_refused(found: Any) -> None:
    level, message, lines = found["stranger"]
    assert level == 1
    assert "/chat of /stranger: it runs at `10.9.9.9`, which is not a host of island koala" in message
    assert lines["koala /chat"] == DRIVER


def test_names_that_a_killed_relay_left_are_released(found: Any) -> None:
    """The script waits until they are: its nodes had ended meanwhile."""
    assert found["left by SIGKILL"] == [RELAY, BRAIN]


def test_topics_cross_again_after_a_restart_of_the_master(found: Any) -> None:
    """The script waits for messages of both ways."""
    assert found["after the restart"] == [RELAY, BRAIN]


def test_a_relay_that_is_stopped_leaves_nothing_at_the_master(found: Any) -> None:
    assert (found["status"], found["left by SIGTERM"]) == (0, [])
