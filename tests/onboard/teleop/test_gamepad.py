"""What a joystick's state means, tried with every state that a joystick may have."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.common.systemd import WAITS
from swarm_onboard.teleop.driving import STOP, ZEROS, Fanout, Twist
from swarm_onboard.teleop.gamepad import LET_GO, READY, Hand, Pad, Settings, look, noticed

from swarmctl.spec.catalog import shipped

ROBOTS = ("koala", "k3", "epuck")
DEFAULTS = {name: setting.default for name, setting in shipped()["teleop-joy"].items()}
ARMED = Hand(armed=True)
AXIS = st.floats(-3, 3) | st.sampled_from([0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 1e30])
AXES = st.lists(AXIS, min_size=2, max_size=2) | st.lists(AXIS, max_size=4)
BUTTONS = st.lists(st.sampled_from([0, 1]), min_size=8, max_size=8) | st.lists(st.integers(-1, 2), max_size=8)


def settings_of(**changes) -> Settings:
    return Settings(**{**DEFAULTS, **changes})


def pad(axes=(0.0, 0.0), held=(), seen=0.0, buttons=8, changed=None) -> Pad:
    changed = seen if changed is None else changed
    return Pad(tuple(axes), tuple(int(number in held) for number in range(buttons)), seen, changed)


CHANGES = st.fixed_dictionaries(
    {"dead_zone": st.floats(0, 0.9), "linear_scale": st.floats(-5, 5), "turbo_button": st.integers(-1, 7)}
)


@given(axes=st.tuples(AXIS, AXIS), held=st.sets(st.integers(0, 7)), changes=CHANGES)
def test_any_axes_drive_within_the_scales(axes, held, changes):
    settings = settings_of(**changes)
    twist = look(settings, ROBOTS, ARMED, pad(axes, {*held, settings.deadman_button}), 0.5)[1]
    assert (twist is not None) == all(map(math.isfinite, axes))
    assert twist is None or abs(twist.linear) <= max(abs(settings.linear_scale), settings.turbo_linear_scale)
    assert twist is None or abs(twist.angular) <= settings.turbo_angular_scale


@given(axes=AXES, buttons=BUTTONS, changes=CHANGES, age=st.floats(0, 1))
def test_nothing_drives_without_the_dead_mans_button(axes, buttons, changes, age):
    settings = settings_of(**changes)
    free = [0 if number == settings.deadman_button else value for number, value in enumerate(buttons)]
    assert look(settings, ROBOTS, ARMED, noticed(None, axes, free, 0.0), age)[1] is None


@given(looks=st.lists(st.tuples(st.none() | st.tuples(AXES, BUTTONS), st.floats(0, 1)), max_size=40))
def test_after_every_release_come_zeros_and_then_silence(looks):
    """Whatever the sequence of readings: no robot is left driving, and the last commands are zeros."""
    settings, fanout = settings_of(select_button=5), Fanout(len(ROBOTS))
    hand, state, now = Hand(), None, 0.0
    for seen, passed in looks:
        now += passed
        state = noticed(state, *seen, now) if seen else state
        hand, twist, _ = look(settings, ROBOTS, hand, state, now)
        commands = fanout.step(twist, hand.chosen)
        if twist is None:
            assert all(command == STOP for _, command in commands)
    last = [fanout.step(None) for _ in range(ZEROS)]
    assert all(command == STOP for commands in last for _, command in commands)
    assert fanout.silent
    assert fanout.step(None) == ()


@pytest.mark.parametrize(
    ("state", "changes", "wanted"),
    [
        (pad((0.0, 1.0), {4}), {}, Twist(0.2, 0.0)),
        (pad((0.0, -1.0), {4}), {}, Twist(-0.2, 0.0)),
        (pad((1.0, 0.0), {4}), {}, Twist(0.0, 1.0)),
        (pad((0.0, 0.55), {4}), {}, Twist(0.1, 0.0)),
        (pad((0.1, -0.1), {4}), {}, STOP),
        (pad((1.0, 1.0), {4, 5}), {"turbo_button": 5}, Twist(0.4, 2.0)),
        (pad((0.0, 1.0), {4}), {"linear_scale": -0.3}, Twist(-0.3, 0.0)),
        (pad((0.0, 7.0), {4}), {}, Twist(0.2, 0.0)),
        (pad((0.0, 1.0), {0, 5}), {}, None),
        (pad((0.0, math.nan), {4}), {}, None),
        (pad((0.0, -math.inf), {4}), {}, None),
        (pad((0.0,), {4}), {}, None),
        (pad((0.0, 1.0), {4}, buttons=5), {"turbo_button": 5}, None),
        (pad((), (), buttons=0), {}, None),
        (None, {}, None),
    ],
)  # fmt: skip
def test_a_state_and_what_it_wants(state, changes, wanted):
    _, twist, text = look(settings_of(**changes), ROBOTS, ARMED, state, 0.1)
    assert twist == (wanted and Twist(pytest.approx(wanted.linear), pytest.approx(wanted.angular)))
    assert twist is None or not text.startswith(WAITS)


@pytest.mark.parametrize(
    ("state", "hand", "words"),
    [
        (None, ARMED, "the joystick"),
        (pad((0.0, 1.0), {4}), Hand(), "the dead-man button to be let go"),
        (pad((0.0, 1.0), {4}, buttons=4), ARMED, "the joystick: it has no button 4, only 4"),
        (pad((0.0, math.nan), {4}), ARMED, "the joystick: its axis 1 is not a number"),
    ],
)
def test_what_keeps_it_from_driving_is_what_it_waits_for(state, hand, words):
    assert look(settings_of(), ROBOTS, hand, state, 0.1)[2] == WAITS + words


def test_a_silent_joystick_stops_and_the_log_names_the_parameter():
    held = pad((0.0, 1.0), {4})
    hand, twist, _ = look(settings_of(), ROBOTS, ARMED, held, 0.5)
    assert twist is not None
    hand, twist, state = look(settings_of(), ROBOTS, hand, held, 0.51)
    assert twist is None
    assert "autorepeat_rate" in state


def test_after_a_fault_the_button_must_be_released_first():
    held, free = pad((0.0, 1.0), {4}), pad((0.0, 1.0))
    hand, _, _ = look(settings_of(), ROBOTS, ARMED, pad((0.0, math.nan), {4}), 0.0)
    hand, twist, state = look(settings_of(), ROBOTS, hand, held, 0.0)
    assert (twist, state) == (None, LET_GO)
    hand, twist, state = look(settings_of(), ROBOTS, hand, free, 0.0)
    assert (twist, state) == (None, READY)
    _, twist, state = look(settings_of(), ROBOTS, hand, held, 0.0)
    assert twist is not None
    assert state == "drives koala, k3, epuck"


def test_a_button_that_is_held_when_the_program_starts_drives_nothing():
    assert look(settings_of(), ROBOTS, Hand(), pad((0.0, 1.0), {4}), 0.0)[1] is None


def test_an_unchanging_joystick_times_out_if_the_settings_say_so():
    frozen = pad((0.0, 1.0), {4}, seen=3.0, changed=1.0)
    assert look(settings_of(), ROBOTS, ARMED, frozen, 3.0)[1] is not None
    assert look(settings_of(still_timeout=1.5), ROBOTS, ARMED, frozen, 3.0)[1] is None


def test_changes_are_noticed():
    first = noticed(None, [0.0], [0], 1.0)
    again = noticed(first, [0.0], [0], 2.0)
    assert (again.seen, again.changed) == (2.0, 1.0)
    assert noticed(again, [0.1], [0], 3.0).changed == 3.0


def test_the_select_button_cycles_through_the_robots_at_rest():
    settings, hand, chosen = settings_of(select_button=5), ARMED, []
    for held in [{5}, {5}, set(), {5}, {4, 5}, {4}, set(), {5}, set(), {5}]:
        hand, _, _ = look(settings, ROBOTS, hand, pad(held=held), 0.0)
        chosen.append(hand.chosen)
    assert chosen == [0, 0, 0, 1, 1, 1, 1, 2, 2, None]


def test_who_is_no_longer_chosen_is_stopped():
    fanout, ahead = Fanout(2), Twist(0.1, 0.0)
    assert fanout.step(ahead) == ((0, ahead), (1, ahead))
    assert fanout.step(ahead, 1) == ((0, STOP), (1, ahead))
    assert [fanout.step(None) for _ in range(ZEROS - 1)] == [((0, STOP), (1, STOP))] * (ZEROS - 1)
    assert fanout.step(None) == ((1, STOP),)
    assert fanout.silent
