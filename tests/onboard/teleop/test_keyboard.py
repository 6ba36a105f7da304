"""What keys mean: events and times on one side, twists on the other."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.teleop.driving import Twist
from swarm_onboard.teleop.keyboard import BURST, MOVES, Keys, Settings, decoded, line, pressed

from swarmctl.spec.catalog import shipped

KNOWN = shipped()["teleop-key"]
SETTINGS = Settings(
    **{name: setting.default for name, setting in KNOWN.items()},
    speed_bounds=(KNOWN["speed"].min, KNOWN["speed"].max),
    turn_bounds=(KNOWN["turn"].min, KNOWN["turn"].max),
)
START = Keys(SETTINGS.speed, SETTINGS.turn)


def after(*events: tuple[float, str]) -> Keys:
    keys = START
    for at, key in events:
        keys = pressed(SETTINGS, 2, keys, [key], at)
    return keys


@pytest.mark.parametrize(
    ("key", "wanted"),
    [
        ("i", (0.2, 0.0)), (",", (-0.2, 0.0)), ("j", (0.0, 1.0)), ("l", (0.0, -1.0)),
        ("u", (0.2, 1.0)), ("o", (0.2, -1.0)), ("m", (-0.2, -1.0)), (".", (-0.2, 1.0)),
        ("up", (0.2, 0.0)), ("down", (-0.2, 0.0)), ("left", (0.0, 1.0)), ("right", (0.0, -1.0)),
    ],
)  # fmt: skip
def test_each_key_of_the_papers_figure_moves_as_it_says(key, wanted):
    assert after((0.0, key)).twist(0.1) == Twist(*wanted)


@pytest.mark.parametrize(
    ("events", "moving_until"),
    [
        ([(0.0, "i")], 0.7),  # a tap: long enough for the keyboard's first repeat
        ([(0.0, "i"), (0.5, "i")], 0.75),  # repeats have begun
        ([(0.0, "i"), (0.5, "i"), (0.53, "i")], 0.78),
        ([(0.0, "i"), (0.1, "i")], 0.7),  # pressed twice: the second may be the one that is held
        ([(0.0, "i"), (0.2, "j")], 0.9),  # another key is a new one
        ([(0.0, "i"), (0.3, "k")], 0.3),
        ([(0.0, "i"), (0.3, " ")], 0.3),
        ([(0.0, "i"), (0.3, "y")], 0.3),
        ([(0.0, "i"), (0.3, "\x1a")], 0.3),
        ([(0.0, "i"), (0.3, "1")], 0.3),  # another robot is chosen: not while driving
        ([(0.0, "i"), (0.3, "q")], 0.7),
        ([(0.0, "q")], 0.0),
    ],
)  # fmt: skip
def test_a_key_counts_as_held_while_its_repeats_come(events, moving_until):
    keys, last = after(*events), events[-1][0]
    if moving_until > last:
        assert keys.twist(moving_until - 0.01) is not None
    assert keys.twist(max(moving_until, last)) is None


@pytest.mark.parametrize(
    ("key", "speed", "turn"),
    [
        ("q", 0.22, 1.1),
        ("z", 0.18, 0.9),
        ("w", 0.22, 1.0),
        ("x", 0.18, 1.0),
        ("e", 0.2, 1.1),
        ("c", 0.2, 0.9),
    ],
)
def test_speeds_change_by_a_tenth(key, speed, turn):
    keys = after((0.0, key))
    assert (keys.speed, keys.turn) == (pytest.approx(speed), pytest.approx(turn))


@given(st.lists(st.sampled_from([*MOVES, *"qzwxeck 012"]), max_size=300), st.floats(0, 1))
def test_no_keys_lead_out_of_the_bounds(typed, later):
    keys = START
    for place, key in enumerate(typed):
        keys = pressed(SETTINGS, 2, keys, [key], place * 0.03)
    twist = keys.twist(len(typed) * 0.03 + later)
    assert twist is None or (
        abs(twist.linear) <= KNOWN["speed"].max and abs(twist.angular) <= KNOWN["turn"].max
    )
    assert keys.chosen in (None, 0, 1)


def test_keys_that_a_stuck_connection_brings_all_at_once_stop():
    assert pressed(SETTINGS, 2, START, ["i"] * BURST, 0.0).twist(0.1) is not None
    assert pressed(SETTINGS, 2, START, ["i"] * (BURST + 1), 0.0).twist(0.1) is None


@pytest.mark.parametrize(
    ("typed", "keys", "rest"),
    [
        (b"i,k ", ["i", ",", "k", " "], b""),
        (b"I", ["i"], b""),  # caps lock
        (b"\x1b[A\x1b[B\x1bOC\x1bOD", ["up", "down", "right", "left"], b""),
        (b"\x1b", [], b"\x1b"),
        (b"i\x1b[", ["i"], b"\x1b["),
        (b"\x1b[1;5", [], b"\x1b[1;5"),
        (b"\x1b\x1b[A", ["\x1b", "up"], b""),
        (b"\x1b[1;5A", ["\x1b[1;5a"], b""),  # with Ctrl held: some other key, and so a stop
        (b"\x1b[3~i", ["\x1b[3~", "i"], b""),
    ],
)
def test_what_a_terminal_sends(typed, keys, rest):
    assert decoded(typed) == (keys, rest)


@given(st.binary(max_size=60), st.integers(0, 60))
def test_split_bytes_make_no_difference_and_no_key_sticks(typed, cut):
    first, rest = decoded(typed[:cut])
    second, rest = decoded(rest + typed[cut:])
    assert (first + second, rest) == decoded(typed)
    assert decoded(rest + b"\ni")[0][-1] == "i"


def test_the_line_fits_the_terminal():
    text = line(("koala", "epuck"), after((0.0, "i")), 0.1, 80)
    assert text == "drives (i)     speed 0.20 m/s  turn 1.00 rad/s  koala, epuck"
    assert line(("koala", "epuck"), after((0.0, "2")), 0.1, 80).endswith("rad/s  epuck")
    assert len(line(tuple(f"robot-{number}" for number in range(50)), START, 0.0, 80)) == 79
