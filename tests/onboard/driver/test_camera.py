"""Images on a slow line: what takes long never holds up a stop, and what is not an image is none.

The robot here does one thing after the other, as an e-puck does: a speed that comes while it sends an image
is taken up when the image is out.
"""

from __future__ import annotations

import struct
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from swarm_onboard.driver import readings
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.driver import Phase
from swarm_onboard.driver.protocols import BinaryQuery

from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import watchdog_of
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.spec.catalog import load_catalog
from tests.onboard.driver.fakes import Bench, Clock, config_for

BAUD = 115200
SENSES = struct.calcsize("<3h3f3h3fb8h8hH4H2hHB3BB3h3hB")
PIECE = 64  # bytes that arrive at once
STEP = 0.0004  # m/s from one command to the next
LATE = 0.05  # s for the exchanges that are on the line already


class SlowEpuck:
    """An e-puck2 on the fake clock: ``capture`` s until it has an image, then its bytes one by one."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.capture = 0.24
        self.says = (0, 40, 40)  # of its images
        self.size = 1600
        self.confirms = b"j\r\n"
        self.silent_to: tuple[int, ...] = ()
        self.free_at = 0.0
        self.coming: list[tuple[float, bytes]] = []
        self.taken_up: list[tuple[float, tuple[int, int]]] = []  # speeds, and when the wheels had them
        self.requests: list[tuple[float, int]] = []

    def open(self) -> SlowEpuck:
        return self

    def write(self, data: bytes) -> None:
        self.requests.append((self.clock.now, data[0]))
        begins = max(self.clock.now, self.free_at) + 0.004
        if data[0] in self.silent_to:
            return
        if data[0] == 0xBC:
            self.taken_up.append((begins, struct.unpack("<2h", data[1:5])))
            answer = data[1:5]
        elif data[0] == 0xB7:
            begins += self.capture
            answer = bytes(self.says) + bytes(7 for _ in range(self.size))
        else:
            answer = self.confirms if data[:1] == b"J" else bytes(SENSES)
        for start in range(0, len(answer), PIECE):
            piece = answer[start : start + PIECE]
            begins += len(piece) * 10 / BAUD
            self.coming.append((begins, piece))
        self.free_at = begins

    def read(self, timeout: float) -> bytes:
        end = self.clock.now + timeout
        if not self.coming or self.coming[0][0] > end:
            self.clock.now = max(self.clock.now, end)
            return b""
        self.clock.now = max(self.clock.now, self.coming[0][0])
        return self.coming.pop(0)[1]

    def drain(self) -> None:
        self.coming = [one for one in self.coming if one[0] > self.clock.now]

    def close(self) -> None:
        """Nothing to let go of."""


def epuck(rate: float = 2.0, **settings: object) -> Config:
    return config_for("epuck2", rates={"camera": rate}, **settings)


def ready(config: Config | None = None, **robot: object) -> Bench:
    bench = Bench(config or epuck(), SlowEpuck)
    vars(bench.robot).update(robot)
    bench.run(1.0)
    assert bench.driver.phase is Phase.READY
    return bench


def images(bench: Bench) -> int:
    return sum(name == "camera" for name, _ in bench.sink.readings)


def drive(bench: Bench, seconds: float, every: float = 0.1) -> list[float]:
    """Commands that go ever faster; when each was given."""
    given_at = []
    for number in range(round(seconds / every)):
        given_at.append(bench.clock.now)
        bench.command(0.01 + STEP * number)
        bench.run(max(0.0, given_at[0] + (number + 1) * every - bench.clock.now))
    return given_at


@given(seconds=st.floats(0.4, 2.0), every=st.sampled_from([0.02, 0.1, 0.25, 0.4]))
@settings(max_examples=60)
def test_the_dead_man_stops_a_robot_in_time_during_images(seconds, every):
    bench = ready(epuck(rate=5.0))
    drive(bench, seconds, every)
    bench.command(0.02)
    last = bench.clock.now
    bench.run(1.5)
    stopped = next(at for at, speeds in bench.robot.taken_up if at > last + 0.3 and speeds == (0, 0))
    assert stopped - last <= 0.5 + LATE
    assert bench.sink.reports[-1].values["failed exchanges"] == "0"


def test_no_command_waits_for_more_than_one_image():
    bench = ready(epuck(rate=1.0))
    given_at = drive(bench, 20.0)
    assert 18 <= images(bench) <= 22
    # 0.38 s of each second are the image.
    assert float(bench.sink.reports[-1].values["odom rate"].split()[0]) >= 6.5
    for number, at in enumerate(given_at[:-10]):
        units = round((0.01 + STEP * number) * 7763.6)
        taken_up = next(when for when, (left, _) in bench.robot.taken_up if left >= units)
        assert taken_up - at <= bench.config.waits["image"] + LATE


def test_no_image_is_begun_before_a_command_that_waits_for_its_turn():
    """Two speeds are a moment apart; an image would make that a long one."""
    bench = ready(epuck(rate=5.0))
    for _ in range(20):
        bench.run(1.0)
        while bench.robot.requests[-1][1] != 0xBC:
            bench.clock.now += min(0.05, bench.driver.step())
        before = len(bench.robot.requests)
        bench.command(0.02)
        bench.run(0.1)
        letters = [letter for _, letter in bench.robot.requests[before:]]
        assert 0xB7 not in letters[: letters.index(0xBC)]


def test_slow_sensors_are_read_while_the_robot_stands():
    bench = ready(epuck(camera={"encoding": "rgb565"}), says=(1, 40, 40), size=3200)
    assert bench.config.waits["image"] > bench.config.command_timeout
    bench.run(3.0)
    standing = images(bench)
    assert standing >= 3
    drive(bench, 1.0)
    driving = images(bench)
    drive(bench, 10.0)
    assert images(bench) == driving
    for _ in range(20):  # commanded to stand
        bench.command(0.0)
        bench.run(0.1)
    assert images(bench) > driving


def test_a_camera_that_is_not_set_gets_no_request():
    """It sends images of another size, and nobody knows for how long."""
    bench = ready(confirms=b"z,Command not found\r\n")
    bench.run(5.0)
    assert 0xB7 not in {letter for _, letter in bench.robot.requests}
    assert "the setup `setup 4a 2c" in bench.sink.reports[-1].message
    assert "camera comes at 0.0 instead of 2 Hz" in bench.sink.reports[-1].message
    drive(bench, 1.0)
    assert bench.robot.taken_up[-1][1] != (0, 0)


@pytest.mark.parametrize("says", [(1, 40, 40), (0, 20, 80)])
def test_another_image_than_was_set_is_none(says):
    bench = ready(says=says)
    bench.run(5.0)
    assert images(bench) == 0
    assert int(bench.sink.reports[-1].values["failed exchanges"]) >= 3


@pytest.mark.parametrize(("side", "lost"), [(40, False), (8, True)])
def test_the_rest_of_a_larger_image_is_no_position(side, lost):
    """As after a reset: the camera is at 40 x 40 in colours again. A new connection sets it anew."""
    bench = ready(epuck(camera={"width": side, "height": side}), says=(0, side, side), size=side * side)
    bench.robot.says, bench.robot.size = (1, 40, 40), 3200
    before = images(bench)
    bench.run(10.0)
    assert (int(bench.sink.reports[-1].values["connections"]) > 1) is lost
    drive(bench, 10.0)
    assert images(bench) == before
    assert {pose.driven for pose in bench.sink.poses} == {0.0}


@pytest.mark.parametrize("silent_to", [(0xB7,), (0xF8,), (0xB7, 0xF8), (0xBC, 0xB7)])
def test_whatever_is_not_answered_the_driver_shows_that_it_is_alive(silent_to):
    tuned = RobotSettings.model_validate({"rates": {"camera": 2.0}})
    watchdog = watchdog_of(with_protocol(load_catalog().types)["epuck2"], BAUD, tuned)
    bench = ready()
    bench.robot.silent_to = silent_to
    for number in range(300):
        before = bench.clock.now
        wait = bench.driver.step()
        assert bench.clock.now - before <= watchdog / 2 + 1e-9
        bench.clock.now += min(wait, 0.3)
        if number % 10 == 0:
            bench.command(0.02)


def test_a_camera_that_is_silent_is_left_alone_and_the_rest_comes():
    bench = ready()
    bench.robot.silent_to = (0xB7,)
    silent_from = bench.clock.now
    drive(bench, 10.0)
    times = [at for at, letter in bench.robot.requests if letter == 0xB7 and at > silent_from]
    assert min(later - before for before, later in pairwise(times)) >= 1.0
    assert float(bench.sink.reports[-1].values["odom rate"].split()[0]) >= 5


def test_the_bytes_that_set_the_camera_are_those_of_the_manual():
    protocol = config_for("epuck-binary", rates={"camera": 1.0}, camera={"width": 30, "zoom": 4}).protocol
    assert [bytes.fromhex(one.send) for one in protocol.setup] == [b"J,0,30,40,4\r"]
    assert [one.begins for one in protocol.setup] == [(106, 13, 10)]
    assert protocol.queries["image"] == BinaryQuery("b7 00", "B B B 1200B", (0, 30, 40))


def test_a_camera_that_is_off_is_not_set():
    assert config_for("epuck2").protocol.setup == ()
    assert config_for("epuck2").waits == {}


@pytest.mark.parametrize(
    ("pixel", "rgb"),
    [
        ((0xF8, 0x00), (255, 0, 0)),
        ((0x07, 0xE0), (0, 255, 0)),
        ((0x00, 0x1F), (0, 0, 255)),
        ((0xFF, 0xFF), (255, 255, 255)),
        ((0x84, 0x10), (132, 130, 132)),
    ],
)
def test_colours_of_16_bits_are_high_byte_first(pixel, rgb):
    assert readings.picture(pixel * 2, {"encoding": "rgb565"}) == ("rgb8", bytes(rgb * 2))
    assert readings.picture(pixel, {"encoding": "mono8"}) == ("mono8", bytes(pixel))
