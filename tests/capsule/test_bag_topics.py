"""Topics of the bags of a trial, read from bags of both kinds that a test has written."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy
import pytest
from rosbags.typesys import Stores, get_typestore
from swarm_onboard.ros2_recorder.bag_files import BagFiles

from swarmctl.capsule.bag_files import recorder
from swarmctl.capsule.bag_topics import read
from swarmctl.capsule.trajectory import Sample
from tests.ui.bag_files import BEGAN, TYPES, command, header, odometry, point, write

ROS2 = get_typestore(Stores.ROS2_JAZZY)


def test_a_topic_has_its_messages_and_samples_at_full_rate(tmp_path: Path) -> None:
    recorded = [(number / 50, *odometry(number / 50, 2.0, math.pi / 2, speed=0.15)) for number in range(100)]
    write(tmp_path / "k3-pi_2026-11-30-14-15-00_0.bag", [*recorded, (2.0, *command(0.2))])
    found = read(tmp_path, {"/koala/odom", "/koala/cmd_vel", "/koala/scan"})
    assert found.troubles == []
    assert {name: one.messages for name, one in found.topics.items()} == {
        "/koala/odom": 100, "/koala/cmd_vel": 1,
    }  # fmt: skip
    samples = found.topics["/koala/odom"].samples
    assert len(samples) == 100
    assert samples[50] == pytest.approx(Sample(BEGAN + 1, 1.0, 2.0, math.pi / 2, 0.15))
    assert found.topics["/koala/odom"].odometry
    assert not found.topics["/koala/cmd_vel"].samples


def test_a_recording_of_ros_2_is_read(tmp_path: Path) -> None:
    kinds = ROS2.types
    pose = kinds["geometry_msgs/msg/Pose"](
        kinds["geometry_msgs/msg/Point"](1.0, 2.0, 0.0),
        kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 1.0, 0.0),
    )
    vector, unknown = kinds["geometry_msgs/msg/Vector3"], numpy.zeros(36)
    twist = kinds["geometry_msgs/msg/Twist"](vector(-0.25, 0.0, 0.0), vector(0.0, 0.0, 0.0))
    stamp = kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](0, 0), "odom")
    message = kinds["nav_msgs/msg/Odometry"](
        stamp,
        "base_link",
        kinds["geometry_msgs/msg/PoseWithCovariance"](pose, unknown),
        kinds["geometry_msgs/msg/TwistWithCovariance"](twist, unknown),
    )
    bags = BagFiles(f"{tmp_path}/k3-pi", 1 << 20, lambda one: ROS2.generate_msgdef(one, ros_version=2)[0])
    data = bytes(ROS2.serialize_cdr(message, "nav_msgs/msg/Odometry"))
    for time in (round(1e9 * BEGAN), round(1e9 * BEGAN) + 10**9):
        bags.add("/k3/odom", "nav_msgs/msg/Odometry", data, time, time)
    bags.close()
    (topic,) = read(tmp_path).topics.values()
    assert (topic.messages, topic.odometry) == (2, True)
    assert topic.samples[1] == pytest.approx(Sample(BEGAN + 1, 1.0, 2.0, math.pi, -0.25))


def stamped(kind: str, *parts: Any) -> Any:
    return TYPES[f"geometry_msgs/msg/{kind}"](header(), *parts)


def test_each_type_with_a_pose_has_samples(tmp_path: Path) -> None:
    pose = TYPES["geometry_msgs/msg/Pose"](
        point(1.0, 2.0), TYPES["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    )
    with_covariance = TYPES["geometry_msgs/msg/PoseWithCovariance"](pose, numpy.zeros(36))
    recorded = [
        (0.0, "/pose", pose),
        (0.1, "/stamped", stamped("PoseStamped", pose)),
        (0.2, "/amcl_pose", stamped("PoseWithCovarianceStamped", with_covariance)),
        (0.3, "/pose2d", TYPES["geometry_msgs/msg/Pose2D"](1.0, 2.0, 0.0)),
        (0.4, *command(0.1)),
    ]
    write(tmp_path / "a.bag", recorded)
    found = read(tmp_path).topics
    assert sorted(found) == ["/amcl_pose", "/pose", "/pose2d", "/stamped"]
    for one in found.values():
        assert [sample[1:] for sample in one.samples] == [(1.0, 2.0, 0.0, None)]
        assert not one.odometry


def test_a_topic_that_two_hosts_recorded_counts_once(tmp_path: Path) -> None:
    """Bags of one host are one recording; the host with more of the topic has it."""
    write(tmp_path / "k3-pi_2026-11-30-14-15-00_0.bag", [(0.0, *odometry(0.0)), (0.5, *odometry(0.5))])
    write(tmp_path / "k3-pi_2026-11-30-14-15-00_1.bag", [(1.0, *odometry(1.0))])
    write(tmp_path / "laptop_2026-11-30-14-15-00_0.bag", [(0.001, *odometry(0.0)), (0.501, *odometry(0.5))])
    (topic,) = read(tmp_path).topics.values()
    assert topic.messages == 3
    assert [one.x for one in topic.samples] == [0.0, 0.5, 1.0]


@pytest.mark.parametrize(
    ("name", "host"),
    [
        ("k3-pi_2026-11-30-14-15-00_0.bag", "k3-pi"),
        ("k3-pi_2026-11-30-14-15-00_12.mcap", "k3-pi"),
        ("pi_2_0.mcap", "pi_2"),
        ("run", "run"),
    ],
)
def test_the_host_of_a_bag_is_in_its_name(name: str, host: str) -> None:
    assert recorder(Path(name)) == host


def test_samples_are_in_the_order_of_time(tmp_path: Path) -> None:
    """The tenth bag of a recording comes before the second by name."""
    write(tmp_path / "a_10.bag", [(1.0, *odometry(1.0))])
    write(tmp_path / "a_9.bag", [(0.0, *odometry(0.0))])
    (topic,) = read(tmp_path).topics.values()
    assert [one.x for one in topic.samples] == [0.0, 1.0]


def test_what_is_no_place_is_no_sample(tmp_path: Path) -> None:
    messages = [odometry(math.nan), odometry(1e300), odometry(0.0, math.inf)]
    write(tmp_path / "a.bag", [(0.1 * number, *one) for number, one in enumerate(messages)])
    write(tmp_path / "a_1.bag", [(1.0, *odometry(1.0, speed=math.nan))])
    (topic,) = read(tmp_path).topics.values()
    assert topic.messages == 4
    assert [one[1:] for one in topic.samples] == [(1.0, 0.0, 0.0, None)]


def test_damaged_bags_are_named_and_the_others_are_read(tmp_path: Path) -> None:
    content = write(tmp_path / "a.bag", [(0.0, *odometry(1.0))]).read_bytes()
    (tmp_path / "b.bag").write_bytes(content[: len(content) // 2])
    (tmp_path / "c\x1b.mcap").write_text("no bag")
    (tmp_path / "d.mcap.active").touch()
    os.mkfifo(tmp_path / "e.bag")
    found = read(tmp_path)
    assert list(found.topics) == ["/koala/odom"]
    assert [one.replace(f"{tmp_path}/", "") for one in found.troubles] == [
        "b.bag is not read: its index is missing or damaged. `rosbag reindex b.bag`",
        "c\\x1b.mcap is not read: it is damaged, or no bag",
        "d.mcap.active is not read: it was not closed. `mcap recover d.mcap.active -o d.mcap`",
        "e.bag is not read: it is damaged, or no bag",
    ]


def test_a_folder_that_is_none_has_no_bags(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert (read(tmp_path / "missing").topics, read(tmp_path / "missing").troubles) == ({}, [])
    assert read(tmp_path / "file").troubles == [f"{tmp_path}/file is not read: Not a directory"]


def test_names_of_topics_are_printable(tmp_path: Path) -> None:
    write(tmp_path / "a.bag", [(0.0, "/k3/\x1b[2Jodom", odometry(1.0)[1])])
    assert list(read(tmp_path).topics) == ["/k3/\\x1b[2Jodom"]


def test_what_is_older_than_the_trial_does_not_count(tmp_path: Path) -> None:
    for host in ("k3-pi", "hub"):
        write(tmp_path / f"{host}_0.bag", [(at, *odometry(at, robot="k3")) for at in (1.0, 2.0, 3.0)])
    topic = read(tmp_path, {"/k3/odom"}, lambda host: BEGAN + (2.0 if host == "k3-pi" else 2.5)).topics[
        "/k3/odom"
    ]
    assert (topic.messages, topic.recorder) == (2, "k3-pi")
    assert [one.x for one in topic.samples] == [2.0, 3.0]
