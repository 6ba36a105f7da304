"""The kernel's joystick, played by a pipe: it speaks, vanishes and comes back."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.teleop.device import Device

from tests.onboard.teleop.teleop_process import DEADMAN, Joystick


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def stick(tmp_path):
    return Joystick(tmp_path / "js0")


@pytest.fixture
def device(stick, clock):
    device = Device(str(stick.path), clock)
    yield device
    device.close()


def test_forward_and_left_are_positive_as_in_joy_nodes_messages(stick, device):
    stick.plug()
    stick.push(1, -32767)
    stick.push(0, 32767)
    stick.press(DEADMAN)
    pad = device.poll()
    assert pad.axes == (-1.0, 1.0)
    assert pad.held(DEADMAN)
    assert not pad.held(DEADMAN + 1)
    stick.push(1, -32768)
    assert device.poll().axes[1] == pytest.approx(1.0, abs=1e-4)
    stick.unplug()


def test_a_held_stick_without_events_lasts_as_long_as_its_device(stick, device, clock):
    stick.plug()
    stick.press(DEADMAN)
    before = device.poll()
    clock.now += 5
    pad = device.poll()
    assert (pad.seen, pad.changed) == (before.seen + 5, before.changed)
    stick.unplug()


def test_a_joystick_that_vanishes_loses_its_state_and_may_return(stick, device, clock):
    assert device.poll() is None
    assert device.trouble == f"{stick.path}: it is not plugged in"
    stick.plug()
    assert device.poll() is None, "it does not try again and again"
    clock.now += 1
    stick.press(DEADMAN)
    assert device.poll().held(DEADMAN)
    stick.unplug()
    assert device.poll() is None
    stick.plug(axes=1)
    clock.now += 1
    pad = device.poll()
    assert not pad.held(DEADMAN)
    assert pad.axes == (0.0,)
    stick.unplug()


def test_a_device_that_must_not_be_read_says_which_group_may(stick, clock, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("os.open", refuse)
    device = Device("/dev/input/js0", clock)
    assert device.poll() is None
    assert "group is `input`" in device.trouble


@given(st.binary(max_size=400), st.integers(1, 17))
def test_any_bytes_give_axes_from_minus_one_to_one(data, piece):
    device = Device("nowhere")
    whole = Device("nowhere")
    for one, pieces in ((device, range(0, len(data), piece)), (whole, [0])):
        size = piece if one is device else len(data)
        feed = iter([data[start : start + size] for start in pieces])

        def read(_file, _count, feed=feed):
            for some in feed:
                if some:
                    return some
            raise BlockingIOError

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("os.read", read)
            one._read(0)
    assert (device._axes, device._buttons) == (whole._axes, whole._buttons)
    assert all(math.isfinite(value) and -1 <= value <= 1.0001 for value in device._axes.values())
    assert len(device._rest) == len(data) % struct.calcsize("=IhBB")
