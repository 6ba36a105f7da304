"""Boards with rosserial: what their library can hold, and the settings of the sketch that swarmctl writes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Literal

import yaml
from pydantic import Field

from swarmctl import resources
from swarmctl.field_types import Model
from swarmctl.units import Unit

PINS = ("encoder", "enable", "forward", "backward")

Pin = Annotated[int, Field(ge=4, le=19, examples=[7])]
Pwm = Annotated[float, Field(ge=0, le=250, examples=[60.0])]  # the loop needs a margin above it

# A kit's motor on a kit's wheel, with an order of magnitude to either side.
FullSpeed = Annotated[float, Field(ge=0.05, le=20, examples=[0.6]), Unit("m/s")]
# Less is not a robot that gets going within sight; more is no ramp: wheels slip at 10 m/s².
Acceleration = Annotated[float, Field(ge=0.05, le=50, examples=[1.0]), Unit("m/s²")]
# At 255, a wheel that is 1 rad/s too slow gets all of the PWM: a switch, not a loop.
Proportional = Annotated[float, Field(ge=0, le=255, examples=[8.0])]
# As much within a tenth of a second.
Integral = Annotated[float, Field(ge=0, le=2550, examples=[40.0])]

# What the sketch's arithmetic is made for: m/s at a wheel's rim, and m.
SKETCH_BOUNDS = {"wheel_speed_max": (0.02, 5.0), "wheel_radius": (0.005, 0.5)}


class WheelDrive(Model):
    """One motor and its encoder. 14 to 19 are the pins A0 to A5."""

    encoder: Literal[2, 3] | None = Field(
        None,
        description="Pin of the encoder: 2 or 3, which have the interrupts; 2 for the left one by default.",
    )
    enable: Literal[5, 6, 9, 10, 11] | None = Field(
        None,
        description="Pin of ENA or ENB, one with PWM: 5, 6, 9, 10, 11; 5 (left) and 6 (right) by default.",
    )
    forward: Pin | None = Field(
        None, description="Pin that is high to go forward (IN1, IN3); 7 (left) and 11 (right) by default."
    )
    backward: Pin | None = Field(
        None, description="Pin that is high to go backward (IN2, IN4); 8 (left) and 12 (right) by default."
    )
    pwm_min: Pwm | None = Field(
        None, description="PWM at which the motor begins to turn, of 255; 60 by default."
    )
    full_speed: FullSpeed | None = Field(
        None,
        description="Speed on the ground at full PWM; a fifth above `wheel_speed_max` by default.",
    )


class Firmware(Model):
    """The sketch's wiring and tuning; docs/firmware.md shows how to find the numbers."""

    left: WheelDrive = Field(default_factory=WheelDrive, description="The left wheel.")
    right: WheelDrive = Field(default_factory=WheelDrive, description="The right wheel.")
    pulses_per_turn: int | None = Field(
        None,
        ge=1,
        le=2000,
        examples=[20],
        description="Pulses of an encoder in a turn of its wheel; 20 by default.",
    )
    acceleration_max: Acceleration | None = Field(
        None,
        description="How fast a wheel gets faster; 1 by default. It stops at once.",
    )
    stop: Literal["brake", "coast"] | None = Field(
        None, description="Whether standing motors are shorted, which holds the robot; `brake` by default."
    )
    control_period: Annotated[float, Field(ge=0.005, le=0.1, examples=[0.02]), Unit("s")] | None = Field(
        None,
        description="Time between steps of the loops, in whole milliseconds; 0.02 by default.",
    )
    kp: Proportional | None = Field(
        None, description="Steps of PWM (of 255) for each rad/s too slow; 8 by default."
    )
    ki: Integral | None = Field(None, description="Steps of PWM (of 255) for each rad behind; 40 by default.")


NO_FIRMWARE_SETTINGS = Firmware()  # shared by all robots that set nothing

#: Defaults; the speed at full PWM depends on the robot.
DEFAULTS = Firmware(
    left=WheelDrive(encoder=2, enable=5, forward=7, backward=8, pwm_min=60.0),
    right=WheelDrive(encoder=3, enable=6, forward=11, backward=12, pwm_min=60.0),
    pulses_per_turn=20,
    acceleration_max=1.0,
    stop="brake",
    control_period=0.02,
    kp=8.0,
    ki=40.0,
)


def completed(declared: Firmware) -> Firmware:
    """Returns the settings with defaults for all that is left out."""
    wheels = {
        side: getattr(DEFAULTS, side).model_copy(update=getattr(declared, side).model_dump(exclude_none=True))
        for side in ("left", "right")
    }
    rest = declared.model_dump(exclude_none=True, exclude={"left", "right"})
    return DEFAULTS.model_copy(update={**rest, **wheels})


def clashes(declared: Firmware) -> Iterator[tuple[tuple[str, str], tuple[str, str], int]]:
    """Yields pins with two uses: the keys of the second and the first use, and the pin."""
    whole = completed(declared)
    used: dict[int, tuple[str, str]] = {}
    for side in ("left", "right"):
        for name in PINS:
            pin = getattr(getattr(whole, side), name)
            if pin in used:
                yield (side, name), used[pin], pin
            used.setdefault(pin, (side, name))


@dataclass(frozen=True)
class Board:
    """Places for publishers and subscribers, and the two buffers in bytes."""

    title: str
    publishers: int
    subscribers: int
    receives: int
    sends: int


@cache
def boards() -> Mapping[str, Board]:
    """Returns every known board by name (templates/data/boards.yaml)."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    data = yaml.load((resources.templates() / "data/boards.yaml").read_text("utf-8"), loader)
    return {name: Board(**fields) for name, fields in data.items()}


FRAME_NAME = 16  # characters that the name of a frame is taken to have, as in `epuck_1/base_link`
_LENGTH = 4  # bytes before a text or a list, which hold its length
_BYTES = {
    "bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4,
    "float32": 4, "int64": 8, "uint64": 8, "float64": 8, "time": 8, "duration": 8,
    "frame": _LENGTH + FRAME_NAME,
}  # fmt: skip
_FIELD = re.compile(r"(?P<type>[A-Za-z0-9_/]+)(?:\[(?P<count>[0-9]*)\])?")


@dataclass(frozen=True)
class MessageSize:
    """Bytes of a message as sent. An ``open`` one has texts or lists, which are counted as empty."""

    bytes: int
    open: bool


@cache
def size_of(type_name: str) -> MessageSize | None:
    """Returns the size of messages of a type, in bytes; None for a type that is not a common one."""
    if type_name in _BYTES:
        return MessageSize(_BYTES[type_name], False)
    if type_name == "string":
        return MessageSize(_LENGTH, True)
    fields = _types().get(type_name)
    if fields is None:
        return None
    package = type_name.partition("/")[0]
    sizes = [_field(field, package) for field in fields]
    return MessageSize(sum(one.bytes for one in sizes), any(one.open for one in sizes))


def _field(field: str, package: str) -> MessageSize:
    match = _FIELD.fullmatch(field)
    if match is None:
        raise ValueError(f"`{field}` is not a field of a message")
    name, count = match["type"], match["count"]
    if count == "":
        return MessageSize(_LENGTH, True)
    one = size_of(name) or size_of(f"{package}/{name}")
    if one is None:
        raise ValueError(f"there is no type `{name}` for a field")
    return MessageSize(one.bytes * int(count or 1), one.open)


@cache
def _types() -> Mapping[str, list[str]]:
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    types: Mapping[str, list[str]] = yaml.load(
        (resources.templates() / "data/message_sizes.yaml").read_text("utf-8"), loader
    )
    return types
