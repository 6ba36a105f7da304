"""What the sketch that swarmctl writes keeps up with on an Arduino UNO: its line, its encoders. Pure numbers.

HardwareSerial of the Arduino core sets the line's divider, and keeps 64 bytes until the main loop reads them.
The sketch waits for a frame twice as long as its longest takes (frame.cpp), so no line is too slow for one.
Orders, each in time for the dead-man, have to leave room on it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

LONGEST = 72  # bytes of a frame that it hears: 64 of a message, and what is around them
ORDER = 56  # bytes: a Twist and its frame
CAREFUL = 0.2  # share of the line for orders: at 9600 baud topics were not negotiated in 5 s
_KEEP_UP = 0.2  # s after which the driver says an order again, or half the dead-man's time
_CLOCK = 16_000_000  # Hz
_OFF = 0.03  # of the line's speed; the data sheet's receiver bears 4 % at both ends together
_FASTEST = 1_000_000  # a byte every 10 µs; an encoder's interrupt takes as long, and the UART holds two
PULSES_PER_SECOND = 2500  # of each wheel: an edge takes 10 µs, a slot has two, a robot two discs
_BITS = 10  # a byte takes on the line: 8N1


def made_baud(baud: int) -> float:
    """What an UNO makes of it: a divider of its clock, as HardwareSerial::begin chooses that."""
    divider, clock = (_CLOCK // 4 // baud - 1) // 2, _CLOCK / 8
    if baud == 57600 or divider > 4095:
        divider, clock = (_CLOCK // 8 // baud - 1) // 2, _CLOCK / 16
    return clock / (max(divider, 0) + 1)


def patience(baud: int) -> float:
    """Seconds that it waits for the rest of a frame; 20 ms at least, as rosserial's own boards."""
    return max(0.02, 2 * LONGEST * _BITS / baud)


def wrong_baud(baud: int, dead_man: float) -> str:
    """What is wrong with a line of that speed; nothing if orders pass. ``dead_man`` in s."""
    if baud > _FASTEST:
        return f"bytes at {baud} baud come faster than an UNO takes them"
    made = made_baud(baud)
    if abs(made / baud - 1) > _OFF:
        return f"an UNO's clock makes {made:.0f} of {baud} baud, {made / baud - 1:+.1%}"
    order, every = ORDER * _BITS / baud, min(_KEEP_UP, dead_man / 2)
    if order > CAREFUL * every:
        return (
            f"an order takes {order * 1000:.0f} ms at {baud} baud, and is said every {every * 1000:.0f} ms "
            "for the dead-man of the board"
        )
    return ""


def good_bauds(known: Iterable[int], dead_man: float) -> list[int]:
    """Those that an UNO bears."""
    return [one for one in known if not wrong_baud(one, dead_man)]


def most_pulses(wheel_speed_max: float, wheel_radius: float) -> int:
    """How many a turn of a wheel may have for the board to count them at full speed (m/s, m)."""
    return int(PULSES_PER_SECOND * 2 * math.pi * wheel_radius / wheel_speed_max)
