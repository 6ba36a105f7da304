"""MCAP files of a recording: what readers find in them, also in one that was never closed."""

from __future__ import annotations

import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from mcap.exceptions import EndOfFile
from mcap.records import Message
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from swarm_onboard.ros2_recorder.bag_files import BagFiles

from swarmctl.remote.agent_archive import agent
from swarmctl.render.bag_recorder import MCAP
from tests.timing import PATIENCE

STORE = get_typestore(Stores.ROS2_JAZZY)
TWIST, ODD = "geometry_msgs/msg/Twist", "other_msgs/msg/Odd"
BEGAN = 1_795_752_643_000_000_000  # ns since 1970


def definition(kind: str) -> str:
    return STORE.generate_msgdef(kind, ros_version=2)[0] if kind == TWIST else ""


def twist(speed: float) -> bytes:
    vector = STORE.types["geometry_msgs/msg/Vector3"]
    message = STORE.types[TWIST](vector(speed, 0.0, 0.0), vector(0.0, 0.0, 0.0))
    return bytes(STORE.serialize_cdr(message, TWIST))


def test_a_message_has_its_topic_its_type_and_both_times(tmp_path: Path) -> None:
    bags = BagFiles(f"{tmp_path}/pi", 1 << 20, definition)
    for number in range(3):
        bags.add("/k3/cmd_vel", TWIST, twist(number), BEGAN + number, BEGAN - 1000)
        bags.flush()
    assert [one.name for one in tmp_path.iterdir()] == ["pi_0.mcap.active"]
    bags.close()
    with AnyReader([tmp_path / "pi_0.mcap"]) as reader:
        found: list[Any] = [
            (one.topic, time, reader.deserialize(data, one.msgtype)) for one, time, data in reader.messages()
        ]
    assert [(topic, time, one.linear.x) for topic, time, one in found] == [
        ("/k3/cmd_vel", BEGAN + number, number) for number in range(3)
    ]
    with (tmp_path / "pi_0.mcap").open("rb") as file:
        sent = {one.publish_time for one in StreamReader(file).records if isinstance(one, Message)}
    assert sent == {BEGAN - 1000}


def test_a_file_that_is_large_enough_is_followed_by_another(tmp_path: Path) -> None:
    bags = BagFiles(f"{tmp_path}/pi", 1 << 20, definition)
    image = bytes(400 << 10)
    for number in range(8):
        bags.add("/image", ODD, image, BEGAN + number, BEGAN)
        bags.add("/k3/cmd_vel", TWIST, twist(number), BEGAN + number, BEGAN)
    bags.close()
    files = sorted(tmp_path.iterdir())
    assert [one.name for one in files] == ["pi_0.mcap", "pi_1.mcap", "pi_2.mcap"]
    times = []
    for one in files:
        assert one.stat().st_size < 2 << 20
        with AnyReader([one]) as reader:
            times += [
                time - BEGAN for connection, time, _ in reader.messages() if connection.msgtype == TWIST
            ]
    assert times == list(range(8))


def test_a_type_without_a_definition_is_read_by_that_of_the_reader(tmp_path: Path) -> None:
    bags = BagFiles(f"{tmp_path}/pi", 1 << 20, lambda _: "")
    bags.add("/k3/cmd_vel", TWIST, twist(0.5), BEGAN, BEGAN)
    bags.close()
    with AnyReader([tmp_path / "pi_0.mcap"], default_typestore=STORE) as reader:
        ((connection, _, data),) = reader.messages()
        message: Any = reader.deserialize(data, connection.msgtype)
    assert (connection.msgtype, message.linear.x) == (TWIST, 0.5)


def test_what_was_flushed_is_in_a_file_that_was_not_closed(tmp_path: Path) -> None:
    bags = BagFiles(f"{tmp_path}/pi", 1 << 20, definition)
    for number in range(3):
        bags.add("/k3/cmd_vel", TWIST, twist(number), BEGAN + number, BEGAN)
    bags.flush()
    bags.add("/k3/cmd_vel", TWIST, twist(3), BEGAN + 3, BEGAN)
    found: list[Any] = []
    with (tmp_path / "pi_0.mcap.active").open("rb") as file, suppress(EndOfFile):
        found.extend(StreamReader(file).records)  # all until it raises
    assert [one.log_time - BEGAN for one in found if isinstance(one, Message)] == [0, 1, 2]
    bags.close()


def test_a_recording_without_messages_is_a_file_that_readers_open(tmp_path: Path) -> None:
    BagFiles(f"{tmp_path}/pi", 1 << 20, definition).close()
    with AnyReader([tmp_path / "pi_0.mcap"], default_typestore=STORE) as reader:
        assert list(reader.messages()) == []


WRITES = """
import sys
sys.path.insert(0, sys.argv[1])
from swarm_onboard.ros2_recorder.bag_files import BagFiles
bags = BagFiles("pi", 1 << 20, lambda kind: "")
bags.add("/image", "other_msgs/msg/Odd", b"data", 1, 1)
bags.close()
"""


def test_the_agent_of_a_host_brings_all_that_writes_them(tmp_path: Path) -> None:
    archive = tmp_path / "agent.zip"
    archive.write_bytes(agent(("record",), MCAP.graph).archive)
    python = [sys.executable, "-I", "-S", "-c", WRITES, str(archive)]
    subprocess.run(python, cwd=tmp_path, check=True, timeout=PATIENCE)
    assert (tmp_path / "pi_0.mcap").exists()
