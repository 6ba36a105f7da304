"""rosserial's own client library, compiled from a checkout, against our host's side.

The environment variable SWARMCTL_ROSSERIAL names a checkout of https://github.com/ros-drivers/rosserial.
"""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from swarm_onboard.rosserial.conversation import (
    Conversation,
    Event,
    Negotiated,
    ParameterRequest,
    Phase,
    Received,
)
from swarm_onboard.rosserial.messages import Log, twist

from tests.onboard.rosserial.fakes import TYPES
from tests.timing import wait_for

CHECKOUT = os.environ.get("SWARMCTL_ROSSERIAL", "")
OURS = Path(__file__).parent / "client"
GENERATED = (
    *("std_msgs/Time.h", "rosserial_msgs/TopicInfo.h"),
    *("rosserial_msgs/Log.h", "rosserial_msgs/RequestParam.h"),
)

pytestmark = [
    pytest.mark.skipif(
        not CHECKOUT, reason="no SWARMCTL_ROSSERIAL: the folder of a checkout of ros-drivers/rosserial"
    ),
    pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ (apt install g++)"),
]


@pytest.fixture(scope="module")
def rover(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("client")
    for name in GENERATED:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text('#include "messages.h"\n')
    library = Path(CHECKOUT) / "rosserial_client/src/ros_lib"
    includes = [f"-I{one}" for one in (folder, OURS, library)]
    sources = [OURS / "rover.cpp", library / "time.cpp", library / "duration.cpp"]
    subprocess.run(["g++", "-O1", "-w", *includes, *sources, "-o", folder / "rover"], check=True)
    return folder / "rover"


class RealBoard:
    """The running rover at one end, our conversation at the other."""

    def __init__(self, program: Path) -> None:
        pipe = subprocess.PIPE
        self.process = subprocess.Popen([program], stdin=pipe, stdout=pipe, stderr=pipe, bufsize=0)
        self.log: list[str] = []
        self.events: list[Event] = []
        self._errors = threading.Thread(target=self._listen)
        self._errors.start()
        os.set_blocking(self.process.stdout.fileno(), False)
        self.host = Conversation(
            self.process.stdin.write,
            TYPES.get,
            settle=0.1,
            clock=time.monotonic,
            wall=lambda: 1_700_000_000_000_000_000,
        )

    def until(self, wish: Callable[[], object]) -> None:
        def fulfilled() -> object:
            self.events += self.host.step(self.process.stdout.read() or b"")
            return wish()

        try:
            wait_for(fulfilled, interval=0.002)
        except AssertionError:
            pytest.fail(f"in vain: {self.events[-5:]}, {self.log}, {self.host.reader.losses}")

    def of(self, kind: type[Event]) -> list[Event]:
        return [event for event in self.events if isinstance(event, kind)]

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self._errors.join()

    def _listen(self) -> None:
        for line in self.process.stderr:
            self.log.append(line.decode().strip())


@pytest.fixture
def board(rover: Path) -> Iterator[RealBoard]:
    one = RealBoard(rover)
    yield one
    one.end()


def test_the_real_client_is_driven(board: RealBoard) -> None:
    board.until(lambda: board.of(Negotiated))
    topics = {(one.name, one.type, one.capacity) for one in board.host.topics}
    assert topics == {
        ("lwheel", "std_msgs/Int32", 120),
        ("rwheel", "std_msgs/Int32", 120),
        ("cmd_vel", "geometry_msgs/Twist", 128),
    }
    board.until(lambda: board.of(ParameterRequest))
    assert board.of(ParameterRequest) == [ParameterRequest("~gain")]
    board.host.parameter("~gain", -42)
    board.until(lambda: "gain -42" in board.log)
    assert board.of(Log)[0] == Log(1, "swarmctl firmware 0123456789ab")
    board.until(lambda: any(line.startswith("now 17000000") for line in board.log))

    board.host.send("cmd_vel", twist(0.2, -0.5))
    board.until(lambda: "cmd_vel 0.2 -0.5" in board.log)
    board.until(lambda: len(board.of(Received)) > 20)
    ticks = {one.topic.name: struct.unpack("<i", one.message)[0] for one in board.of(Received)}
    assert ticks["lwheel"] > 0 > ticks["rwheel"]

    before = board.host.synced_at
    board.until(lambda: board.host.synced_at > before)  # it requests the time every 2.5 s
    assert board.host.phase is Phase.CONNECTED
    assert (board.host.reader.losses.bytes, board.host.strange) == (0, 0)
    board.host.stop()
    board.until(lambda: "tx stop" in board.log)
    time.sleep(0.2)
    board.process.stdout.read()  # what was under way
    time.sleep(0.2)
    assert not board.process.stdout.read()


def test_the_real_client_is_found_through_noise(board: RealBoard) -> None:
    """Noise towards the board costs it frames at most; topics are requested again until it answers."""
    board.process.stdin.write(b"\xff\xfe\x00\xff noise \xff")
    board.until(lambda: board.host.phase is Phase.CONNECTED)
    board.host.send("cmd_vel", twist(0.1, 0.0))
    board.until(lambda: "cmd_vel 0.1 0" in board.log)


def test_the_old_request_makes_the_real_client_answer_as_ever(board: RealBoard) -> None:
    board.process.stdin.write(bytes.fromhex("ffff00000000ff00"))
    board.until(lambda: board.host.phase is Phase.CONNECTED)
    assert not board.host.reader.old_protocol
