"""The program of ``swarmctl topic`` on hosts with real ROS 2, without a lab's network."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from swarmctl.render.topic_tool import Listed, listed
from tests.onboard.gate.ros_host import run_isolated

pytestmark = pytest.mark.lab

TWIST, TEXT, IMAGE, ARRAY = (
    "geometry_msgs/Twist",
    "std_msgs/String",
    "sensor_msgs/Image",
    "std_msgs/ByteMultiArray",
)
STATUS, INFO, STAMPED = (
    "diagnostic_msgs/DiagnosticArray",
    "sensor_msgs/CameraInfo",
    "geometry_msgs/PointStamped",
)
#: A type, the message as it is written, and a part of what is printed of it.
VALUES = (
    (TWIST, "{linear: {x: 1}}", "linear:\n  x: 1.0\n  y: 0.0\n"),
    (TWIST, "{linear: {x: 1e-1, z: -.inf}}", "x: 0.1\n  y: 0.0\n  z: -.inf\n"),
    (STAMPED, "{header: {stamp: now, frame_id: map}}", "    sec: 7\n    nanosec: 8\n  frame_id: map\n"),
    (STAMPED, "{header: auto}", "    sec: 7\n    nanosec: 8\n  frame_id: ''\n"),
    (STATUS, "{status: [{level: 2, values: [{key: a}, {value: b}]}]}", "- level: 2\n"),
    (ARRAY, "{data: [0, 255]}", "data:\n- 0\n- 255\n"),
    (IMAGE, f"{{data: [{', '.join(['7'] * 129)}]}}", "data:\n" + "- 7\n" * 128 + "- '...'\n"),
    (TWIST, "5", "the message: 5 is no mapping of the fields of Twist"),
    (TWIST, "{linear: 5}", "linear: 5 is no mapping of the fields of Vector3"),
    (TWIST, "{linear: {w: 1}}", "linear.w: Vector3 has no such field, but x, y, z"),
    (TWIST, "{linear: {x: fast}}", "linear.x: 'fast' is no number"),
    (TWIST, "{linear: {x: true}}", "linear.x: True is no number"),
    (TEXT, "{data: 5}", "data: 5 is no text, which quotes make of it"),
    (ARRAY, "{data: 5}", "data: 5 is no list"),
    (ARRAY, "{data: [1, 256]}", "data[1]: 256 is no whole number from 0 to 255"),
    ("std_msgs/Int8", "{data: -129}", "data: -129 is no whole number from -128 to 127"),
    ("std_msgs/UInt64", "{data: 1.0}", "data: 1.0 is no whole number from 0 to 18446744073709551615"),
    ("std_msgs/Float32", "{data: 1.0e+39}", "data: 1e+39 is no number from -3.403e+38 to 3.403e+38"),
    ("std_msgs/Bool", "{data: 1}", "data: 1 is no `true` or `false`"),
    (STATUS, "{status: [{}, {values: [{key: 1}]}]}", "status[1].values[0].key: 1 is no text"),
    (INFO, "{k: [1, 2]}", "k: it has 9 elements, not 2"),
)  # fmt: skip


@pytest.fixture(scope="module", params=["jazzy", "kilted"])
def found(request: pytest.FixtureRequest) -> Any:
    """What `topic_on_host.py` prints, if this machine can have the image."""
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
        disk = image.ensure(lambda _line: None, distro=request.param)
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    cases = json.dumps([one[:2] for one in VALUES])
    return run_isolated(Path(__file__).with_name("topic_on_host.py"), disk, request.param, cases)


def test_messages_of_every_type_are_read_as_they_are_printed(found: Any) -> None:
    assert found["messages"]["failures"] == []
    assert {"nav_msgs/Odometry", "sensor_msgs/LaserScan"} <= set(found["messages"]["types"])


def test_values_become_a_message_or_an_error_with_their_path(found: Any) -> None:
    results = found["messages"]["values"]
    assert [one for one, case in zip(results, VALUES, strict=True) if case[2] not in one] == []


def test_the_list_has_types_and_counts_without_what_is_hidden(found: Any) -> None:
    status, printed, errors = found["list"]
    assert (status, errors) == (0, "")
    shown = [one for one in listed(printed) if one.topic not in ("/rosout", "/parameter_events")]
    assert shown == [
        Listed("/beat", "std_msgs/msg/Int32", 0, 1),
        Listed("/chat", "std_msgs/msg/String", 1, 0),
        Listed("/cmd", "std_msgs/msg/String", 0, 1),
        Listed("/odd", "std_msgs/msg/Int32, std_msgs/msg/String", 2, 0),
    ]


@pytest.mark.parametrize(
    ("what", "error"),
    [
        ("several types", "/odd has several types: std_msgs/msg/Int32, std_msgs/msg/String"),
        ("no type", "this host has no message type acme_msgs/msg/Wheel: No module named 'acme_msgs'"),
        ("no field", "text: String has no such field, but data"),
        ("no YAML", "while parsing a flow mapping"),
        ("nobody", "nothing was published: nobody subscribes to /nobody as std_msgs/msg/String"),
        (
            "another type",
            "nothing was published: nobody subscribes to /cmd as std_msgs/msg/Int32, but as std_msgs/msg/S",
        ),
    ],
)
def test_an_error_is_one_line(found: Any, what: str, error: str) -> None:
    status, printed, errors = found["faults"][what]
    assert (status, printed) == (1, "")
    assert errors.startswith(f"error: {error}")
    assert errors.count("\n") == 1


def test_echo_receives_latched_messages_and_later_publishers(found: Any) -> None:
    """The second publisher keeps no messages for those who come later, as the first does."""
    assert (found["latched"], found["later"]) == ("data: north\n", "data: south\n")
    assert found["echo ended"] == [0, ""]


def test_a_message_that_is_published_once_arrives(found: Any) -> None:
    assert (found["once"], found["received"]) == ([0, "", ""], ["it's"])


def test_hz_measures_what_pub_publishes(found: Any) -> None:
    rate, more = found["rate"]
    assert float(re.findall(r"[\d.]+", rate)[0]) == pytest.approx(20, rel=0.5)
    assert re.fullmatch(r"\tmin: \S+s max: \S+s std dev: \S+s window: \d+\n", more)
    assert found["silence"] == "no new messages\n"
    assert found["beat ended"] == [0, "", ""]


def test_it_leaves_the_graph_at_once(found: Any) -> None:
    """Before the node that was killed, which others see for 20 s."""
    assert found["still in the graph"] == ["/late"]
