"""Commands as bytes on the line: values worked out from the manuals, and any Twist.

Its makers' figures: the Koala's unit is 4.5 mm/s, the Khepera III has 144.01 or 218.72 units for 1 mm/s, the
e-puck 1000 steps for a turn of its wheels of 41 mm.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.driver.binary_protocol import BinaryCodec
from swarm_onboard.driver.codec import Codec
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.kinematics import STANDSTILL, wheel_units
from swarm_onboard.driver.polled_robot import linked
from swarm_onboard.driver.tally import Tally

from tests.onboard.driver.fakes import TYPES, config_for

#: The largest speed that each robot's own field holds, and what its maker says it can do.
LARGEST = {"koala": 127, "koala-2.5": 516, "epuck": 1000, "epuck-binary": 1000, "epuck2": 1100}
CONFIGS = {name: config_for(name) for name in TYPES}


class NoPort:
    """Nothing at the other end."""


def codec_of(config: Config) -> Codec:
    return linked(NoPort(), config.protocol, Tally()).codec


def command(type_name: str, linear: float, angular: float, firmware: float | None = None) -> bytes:
    config = CONFIGS[type_name]
    scale = config.kinematics.scale_for(firmware)
    return codec_of(config).speed(*wheel_units(linear, angular, config.kinematics, scale)).data


@pytest.mark.parametrize(
    ("linear", "angular", "sent"),
    [
        (0.2, 0.0, b"D,44,44\n"),
        (0.1, 0.5, b"D,6,38\n"),
        (0.0, 1.0, b"D,-32,32\n"),
        (0.45, 0.0, b"D,100,100\n"),
    ],
)
def test_the_koala(linear: float, angular: float, sent: bytes) -> None:
    assert command("koala", linear, angular) == sent


@pytest.mark.parametrize(
    ("firmware", "linear", "angular", "sent"),
    [
        (2.1, 0.1, 0.0, b"D,l14401,l14401\r"),
        (2.1, 0.1, 0.5, b"D,l11218,l17584\r"),
        (2.1, 0.0, 1.0, b"D,l-6366,l6366\r"),
        (3.0, 0.1, 0.0, b"D,l21872,l21872\r"),
        (3.0, 0.1, 0.5, b"D,l17038,l26706\r"),
        (3.0, 0.0, 1.0, b"D,l-9669,l9669\r"),
    ],
)
def test_the_khepera_in_both_its_scales(firmware: float, linear: float, angular: float, sent: bytes) -> None:
    assert command("khepera3", linear, angular, firmware) == sent


def test_a_khepera_of_unknown_firmware_has_no_scale() -> None:
    assert CONFIGS["khepera3"].kinematics.scale_for(None) is None


@pytest.mark.parametrize(("type_name", "sent"), [("epuck", b"D,776,776\r"), ("koala-2.5", b"D,90,90\r")])
def test_a_tenth_of_a_metre_a_second(type_name: str, sent: bytes) -> None:
    assert command(type_name, 0.1, 0.0) == sent


@pytest.mark.parametrize("type_name", ["epuck-binary", "epuck2"])
def test_the_e_puck_in_bytes(type_name: str) -> None:
    """GCtronic's form is bc f4 01 0c fe 00; E (bb) goes with it, and makes the robot repeat it."""
    assert codec_of(CONFIGS[type_name]).speed(500, -500).data == bytes.fromhex("bc f4 01 0c fe bb 00")
    protocol = CONFIGS[type_name].protocol
    alone = replace(protocol.set_speed, send="bc {left:h} {right:h} 00", reply="", echo=False)
    bare = BinaryCodec(replace(protocol, set_speed=alone)).speed(500, -500)
    assert bare.data == bytes.fromhex("bc f4 01 0c fe 00")
    assert not bare.answered


def test_several_sensors_of_an_e_puck_are_one_request() -> None:
    codec = codec_of(CONFIGS["epuck-binary"])
    assert codec.query("senses").data == bytes.fromhex("9f b2 b1 af 8b 00")
    assert codec_of(CONFIGS["epuck2"]).query("senses").data == bytes.fromhex("f8 00")
    assert struct.calcsize("<" + CONFIGS["epuck2"].protocol.queries["senses"].reply.replace(" ", "")) == 103


TWISTS = st.floats(allow_nan=True, allow_infinity=True) | st.sampled_from(
    [5e-324, -5e-324, 1e308, -1e308, math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-9]
)


@pytest.mark.parametrize("type_name", TYPES)
@given(linear=TWISTS, angular=TWISTS, firmware=st.sampled_from([2.1, 3.0]))
def test_any_twist_is_a_legal_command_within_the_limits(type_name, linear, angular, firmware):
    config = CONFIGS[type_name]
    scale = config.kinematics.scale_for(firmware if type_name == "khepera3" else None)
    left, right = wheel_units(linear, angular, config.kinematics, scale)
    largest = LARGEST.get(type_name, round(0.298 * scale.speed_units_per_mps) + 1)
    assert max(abs(left), abs(right)) <= largest
    sent = codec_of(config).speed(left, right).data
    if type_name.startswith("epuck") and type_name != "epuck":
        assert len(sent) == 7
        assert struct.unpack("<2h", sent[1:5]) == (left, right)
    else:
        assert re.fullmatch(rb"D,l?-?[0-9]{1,6},l?-?[0-9]{1,6}[\r\n]", sent)


@pytest.mark.parametrize("type_name", TYPES)
@given(linear=st.floats(-20, 20), angular=st.floats(-50, 50))
def test_a_command_too_fast_keeps_its_curve(type_name, linear, angular):
    config = CONFIGS[type_name]
    kinematics = replace(config.kinematics, wheel_speed_min=0.0)
    scale = kinematics.scales[-1]
    half = angular * kinematics.wheel_separation / 2
    commanded = (linear - half, linear + half)
    left, right = wheel_units(linear, angular, kinematics, scale)
    # Cross product of what was commanded and what is sent: only rounding to whole units may tilt it.
    length = math.hypot(*commanded)
    if length > 0:
        assert abs(commanded[0] * right - commanded[1] * left) / length <= 0.75


@pytest.mark.parametrize("type_name", TYPES)
@pytest.mark.parametrize("twist", [(math.nan, 0.1), (0.1, math.inf), (1e308, 1e308), (-math.inf, math.nan)])
def test_a_senseless_twist_is_a_stop(type_name, twist):
    config = CONFIGS[type_name]
    assert wheel_units(*twist, config.kinematics, config.kinematics.scales[0]) == STANDSTILL
