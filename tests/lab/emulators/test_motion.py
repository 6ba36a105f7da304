"""What holds for every robot: no bytes kill it, it moves as geometry says, its state is the truth."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.lab.emulators import TYPES, Robot, emulator
from swarmctl.lab.emulators.differential_drive import Sensor, Wall, distance

robots = st.sampled_from(
    [
        ("koala", {}),
        ("koala-2.5", {}),
        ("khepera3", {"firmware": 2}),
        ("khepera3", {"firmware": 3, "server": 0}),
        ("epuck", {}),
        ("epuck2", {}),
        ("arduino-rover", {}),
    ]
)
lines = (
    st.binary()
    | st.text("ABCDEFGHIJKLMNOPQRSTUVWXYZldbg&?,0123456789-\r\n").map(str.encode)
    | st.binary().map(lambda data: b"\xff\xfe" + data)
)
TOPICS = bytes.fromhex("ff fe 00 00 ff 00 00 ff")
speeds = st.floats(-0.12, 0.12)
times = st.floats(0.0, 30.0)

REQUESTS = {
    "koala": [b"D,44,-6\r\n", b"N\n", b"H\r", b"Q\r\n"],
    "khepera3": [b"D,l9000,l-6000\r\n", b"N\n", b"X\r", b"D,1\n"],
    "koala-2.5": [b"D,44,-6\r", b"N\n", b"W,1,2,3\r", b"A,511\r"],
    "epuck": [b"D,300,-200\r", b"N\n", b"\xbc\x0a\x0d\x0c\xfe\xb2\x00", b"\xb7\x00"],
    "epuck2": [b"D,300,-200\r", b"R\n", b"\xf7" + bytes(range(19)) + b"\xf8\x00"],
    "arduino-rover": [TOPICS, bytes.fromhex("fffe3000cf6400") + bytes(48) + b"\x9b", b"\xff" + TOPICS],
}


def drive(robot: Robot, left: float, right: float) -> None:
    robot.chassis.drive(left, right)


@given(robots, st.lists(lines, max_size=8), times)
def test_no_bytes_crash_it(kind: tuple[str, dict[str, int]], chunks: list[bytes], dt: float) -> None:
    name, options = kind
    robot = emulator(name, **options)
    for chunk in chunks:
        answer = robot.receive(chunk)
        assert len(answer) <= 8192 + 700 * len(chunk)
        robot.run_for(dt)
    robot.receive(b"\x00" * 36 + b"\r")  # ends whatever was begun
    robot.run_for(2.0)
    if name == "arduino-rover":
        assert TOPICS[:2] in robot.receive(TOPICS)
    else:
        assert robot.receive(b"E\r").startswith(b"e,")
    json.dumps(dataclasses.asdict(robot.state), allow_nan=False)


@given(robots, st.data())
def test_a_request_may_arrive_in_any_pieces(kind: tuple[str, dict[str, int]], data: st.DataObject) -> None:
    name, options = kind
    whole, cut = emulator(name, **options), emulator(name, **options)
    for request in data.draw(st.lists(st.sampled_from(REQUESTS[name]), max_size=4)):
        places = sorted(data.draw(st.sets(st.integers(0, len(request)))))
        pieces = [request[a:b] for a, b in zip([0, *places], [*places, len(request)], strict=True)]
        assert b"".join(map(cut.receive, pieces)) == whole.receive(request)
    assert cut.state == whole.state


@given(speeds, st.floats(-3.0, 3.0), times)
def test_a_straight_line(speed: float, theta: float, dt: float) -> None:
    robot = emulator("epuck", pose=(1.0, -2.0, theta))
    drive(robot, speed, speed)
    robot.advance(dt)
    state = robot.state
    assert (state.x, state.y) == pytest.approx(
        (1.0 + speed * dt * math.cos(theta), -2.0 + speed * dt * math.sin(theta))
    )
    assert (state.theta, state.distance) == pytest.approx((theta, abs(speed) * dt))


@given(st.sampled_from(sorted(TYPES)), speeds, speeds)
def test_a_full_circle_ends_where_it_began(name: str, left: float, right: float) -> None:
    robot = emulator(name)
    drive(robot, left, right)
    omega = robot.state.omega
    if abs(omega) < 1e-3:
        return
    robot.advance(2 * math.pi / abs(omega))
    state = robot.state
    assert (state.x, state.y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert state.theta == pytest.approx(math.copysign(2 * math.pi, omega))


def test_a_quarter_circle_to_the_left() -> None:
    robot = emulator("koala")
    drive(robot, 1.0 - 0.145, 1.0 + 0.145)  # radius 1 m, one radian per second
    robot.advance(math.pi / 2)
    assert (robot.state.x, robot.state.y, robot.state.theta) == pytest.approx((1.0, 1.0, math.pi / 2))


@given(speeds, speeds, st.lists(st.floats(0.0, 2.0), min_size=1, max_size=20))
def test_time_may_pass_in_any_pieces(left: float, right: float, steps: list[float]) -> None:
    at_once, stepwise = emulator("khepera3"), emulator("khepera3")
    for robot in (at_once, stepwise):
        drive(robot, left, right)
    at_once.advance(sum(steps))
    for step in steps:
        stepwise.advance(step)
    ours, theirs = dataclasses.astuple(at_once.state)[:8], dataclasses.astuple(stepwise.state)[:8]
    assert ours == pytest.approx(theirs, abs=1e-9)


@pytest.mark.parametrize("dt", [-1.0, math.nan, math.inf])
def test_time_only_moves_forward(dt: float) -> None:
    with pytest.raises(ValueError, match="a duration cannot be"):
        emulator("koala").advance(dt)


@pytest.mark.parametrize("name", sorted(TYPES.keys() - {"arduino-rover"}))
def test_the_last_speed_stays_forever(name: str) -> None:
    robot = emulator(name)
    robot.receive(b"D,l9000,l9000\n" if name == "khepera3" else b"D,300,300\r")
    robot.advance(3600.0)
    assert robot.state.distance == pytest.approx(3600.0 * robot.state.v)
    assert robot.state.v > 0.03


@pytest.mark.parametrize("name", TYPES)
def test_switching_off_and_on_stops_it_where_it_is(name: str) -> None:
    robot = emulator(name)
    drive(robot, 0.1, 0.1)
    robot.advance(1.0)
    robot.receive(b"D,")
    assert robot.power_cycle() == robot.banner()
    robot.advance(1.0)
    assert (robot.state.x, robot.state.v) == (pytest.approx(0.1), 0.0)
    assert robot.receive(b"E\r")[:5] in (b"e,0,0", b"")


def test_state_counts_the_commands() -> None:
    epuck = emulator("epuck")
    epuck.receive(b"D,1,2\rX\r")
    assert (epuck.state.commands, epuck.state.last_command) == (2, "X")
    epuck.receive(b"\xbb\x00")
    assert (epuck.state.commands, epuck.state.last_command) == (3, "bb 00")


@settings(max_examples=50)
@given(st.floats(0.1, 5.0), st.floats(-1.2, 1.2))
def test_a_sensor_measures_along_its_ray(gap: float, angle: float) -> None:
    wall = Wall(gap, -50.0, gap, 50.0)
    seen = distance(Sensor(0.0, 0.0, math.degrees(angle)), (0.0, 0.0, 0.0), [wall])
    assert seen == pytest.approx(gap / math.cos(angle))
    assert distance(Sensor(0.0, 0.0, 180.0), (0.0, 0.0, angle), [wall]) == math.inf
