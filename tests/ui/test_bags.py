"""A recorded run, read from the bags that a test has written."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.rosbag1 import Writer
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from swarm_onboard.ros2_recorder.bag_files import BagFiles

from swarmctl.ui import bags
from tests.ui.bag_files import BEGAN, KOALA, LZ4, battery, command, header, odometry, twist, write

LZ4_MAGIC = b"\x04\x22\x4d\x18"


def at(seconds: float) -> float:
    return round(BEGAN + seconds, 3)


@pytest.mark.parametrize("compression", [LZ4, None])
@pytest.mark.parametrize("stamped", [False, True])
def test_a_row_has_pose_speeds_and_battery(
    tmp_path: Path, compression: Writer.CompressionFormat | None, stamped: bool
) -> None:
    recorded = [
        (0.0, *battery(0.75)),
        (0.25, *command(0.2, 0.1, stamped=stamped)),
        (0.3, *odometry(1.0, 2.0, math.pi / 2, speed=0.15, turn=0.05)),
        (0.35, "/diagnostics", command(0.0)[1]),
    ]
    write(tmp_path / "a.bag", recorded, compression)
    run = bags.read(tmp_path, KOALA)
    assert run.troubles == []
    assert run.rows == {
        "koala": [
            (at(0.0), None, None, None, 0.75),
            (at(0.3), [1.0, 2.0, 1.571], [0.15, 0.05], [0.2, 0.1], 0.75),
        ]
    }


def test_a_folder_of_ros_2_is_a_bag(tmp_path: Path) -> None:
    store, kind = get_typestore(Stores.ROS2_JAZZY), "geometry_msgs/msg/Twist"
    with Writer2(tmp_path / "run", version=9) as writer:
        sent = writer.add_connection("/koala/cmd_vel", kind, typestore=store)
        writer.write(sent, round(1e9 * BEGAN), store.serialize_cdr(twist(0.2, 0.1), kind))
    run = bags.read(tmp_path, KOALA)
    assert (run.troubles, run.rows) == ([], {"koala": [(at(0.0), None, None, [0.2, 0.1], None)]})


def test_a_recording_of_ros_2_is_read_from_its_file(tmp_path: Path) -> None:
    store, kind = get_typestore(Stores.ROS2_JAZZY), "geometry_msgs/msg/TwistStamped"
    recorded = BagFiles(f"{tmp_path}/pi", 1 << 20, lambda one: store.generate_msgdef(one, ros_version=2)[0])
    stamped = store.types[kind](header(), twist(0.2, 0.1))
    sent = round(1e9 * BEGAN)
    recorded.add("/koala/cmd_vel", kind, bytes(store.serialize_cdr(stamped, kind)), sent, sent)
    recorded.close()
    (tmp_path / "e.mcap.active").write_bytes((tmp_path / "pi_0.mcap").read_bytes()[:500])
    run = bags.read(tmp_path, KOALA)
    assert run.rows == {"koala": [(at(0.0), None, None, [0.2, 0.1], None)]}
    assert [one.replace(f"{tmp_path}/", "") for one in run.troubles] == [
        "e.mcap.active is not shown: it was not closed. `mcap recover e.mcap.active -o e.mcap`"
    ]


def test_a_robot_has_five_rows_a_second(tmp_path: Path) -> None:
    write(tmp_path / "a.bag", [(number / 50, *odometry(number / 50)) for number in range(100)])
    rows = bags.read(tmp_path, KOALA).rows["koala"]
    assert [row[1][0] for row in rows if row[1]] == [(10 * slot + 9) / 50 for slot in range(10)]


def test_split_bags_and_bags_of_two_hosts_are_one_run(tmp_path: Path) -> None:
    write(tmp_path / "a_0.bag", [(0.0, *odometry(0.0)), (0.3, *odometry(0.3))])
    write(tmp_path / "a_1.bag", [(0.5, *odometry(0.5)), (0.7, *odometry(0.7))])
    write(tmp_path / "b_0.bag", [(0.31, *odometry(0.31)), (0.45, *odometry(0.45))])
    rows = bags.read(tmp_path, KOALA).rows["koala"]
    assert [(row[0], row[1]) for row in rows] == [
        (at(seconds), [seconds, 0.0, 0.0]) for seconds in (0.0, 0.31, 0.5, 0.7)
    ]


def test_a_speed_is_forgotten_and_the_pose_stays(tmp_path: Path) -> None:
    recorded = [(0.0, *odometry(1.0, speed=0.1)), (0.0, *command(0.1)), (1.5, *battery(0.5))]
    write(tmp_path / "a.bag", recorded)
    assert bags.read(tmp_path, KOALA).rows["koala"][-1] == (at(1.5), [1.0, 0.0, 0.0], None, None, 0.5)


def test_what_is_no_number_is_not_shown(tmp_path: Path) -> None:
    write(tmp_path / "a.bag", [(0.0, *odometry(math.nan, speed=0.1)), (0.0, *battery(math.nan))])
    assert bags.read(tmp_path, KOALA).rows["koala"] == [(at(0.0), None, [0.1, 0.0], None, None)]


def test_a_bag_that_cannot_be_read_costs_itself_alone(tmp_path: Path) -> None:
    whole = write(tmp_path / "a.bag", [(0.0, *odometry(1.0))])
    content = whole.read_bytes()
    index = content.index(b"index_pos=") + len(b"index_pos=")
    (tmp_path / "b.bag").write_bytes(content[:index] + bytes(8) + content[index + 8 :])
    (tmp_path / "c.bag").write_bytes(content[: len(content) // 2])
    (tmp_path / "changed.bag").write_bytes(content.replace(LZ4_MAGIC, bytes(4)))
    (tmp_path / "d.bag").write_text("no bag")
    (tmp_path / "e.bag.active").write_bytes(content[:5000])
    (tmp_path / "notes.txt").write_text("of the run")
    run = bags.read(tmp_path, KOALA)
    assert len(run.rows["koala"]) == 1
    assert [one.replace(f"{tmp_path}/", "") for one in run.troubles] == [
        "b.bag is not shown: its index is missing or damaged. `rosbag reindex b.bag`",
        "c.bag is not shown: its index is missing or damaged. `rosbag reindex c.bag`",
        "changed.bag is not shown: it is damaged, or no bag",
        "d.bag is not shown: it is damaged, or no bag",
        "e.bag.active is not shown: it was not closed. `rosbag reindex e.bag.active`, then name it e.bag",
    ]


def test_other_topics_and_other_types_are_no_rows(tmp_path: Path) -> None:
    write(tmp_path / "a.bag", [(0.0, *odometry(1.0, robot="k3")), (0.0, "/koala/odom", command(0.1)[1])])
    assert bags.read(tmp_path, KOALA) == bags.Run()


@given(st.lists(st.tuples(st.integers(0, 300), st.sampled_from("ocb")), min_size=1, max_size=40))
def test_no_row_has_what_was_recorded_after_it(messages: list[tuple[int, str]]) -> None:
    """Each value says when it was recorded; times in 0.01 s."""
    made = {"o": odometry, "c": command, "b": lambda seconds: battery(seconds / 10)}
    recorded = [(time / 100, *made[kind](time / 100)) for time, kind in sorted(messages)]
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder, "a.bag"), recorded)
        rows = bags.read(Path(folder), KOALA).rows["koala"]
    for row in rows:
        time = round(100 * (row[0] - BEGAN))
        poses = [one for one, kind in messages if kind == "o" and one <= time]
        assert (row[1] and round(100 * row[1][0])) == (max(poses) if poses else None)
        assert row[3] is None or round(100 * row[3][0]) <= time
        assert row[4] is None or round(1000 * row[4]) <= time
