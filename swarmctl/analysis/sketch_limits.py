"""Limits of swarmctl's own sketch on an Arduino UNO: the baud rate and the encoder pulses. Pure numbers.

HardwareSerial of the Arduino core sets the divider for the baud rate, and buffers 64 bytes for the main loop.
The sketch waits twice the time of its longest frame (frame.cpp), so no line is too slow for a frame. The
commands, repeated often enough for the dead-man, must leave time on the line for other topics.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

LONGEST = 72  # bytes of a received frame: 64 of a message, and the framing
COMMAND_BYTES = 56  # bytes: a Twist and its frame
CAREFUL = 0.2  # share of the line for commands: at 9600 baud, negotiating topics took more than 5 s
_REPEAT = 0.2  # s after which the driver repeats a command, or half the dead-man's time
_CLOCK = 16_000_000  # Hz
_OFF = 0.03  # relative error of the baud rate; by the data sheet both ends together may be off by 4 %
_FASTEST = 1_000_000  # baud: a byte every 10 µs; an encoder interrupt takes as long, the UART holds two
PULSES_PER_SECOND = 2500  # of each wheel: an edge takes 10 µs, a slot has two, a robot two discs
_BITS = 10  # a byte takes on the line: 8N1


def made_baud(baud: int) -> float:
    """Returns the real baud rate of an UNO: its clock divided as in HardwareSerial::begin."""
    divider, clock = (_CLOCK // 4 // baud - 1) // 2, _CLOCK / 8
    if baud == 57600 or divider > 4095:
        divider, clock = (_CLOCK // 8 // baud - 1) // 2, _CLOCK / 16
    return clock / (max(divider, 0) + 1)


def patience(baud: int) -> float:
    """Seconds that the sketch waits for the rest of a frame; at least 20 ms, as rosserial's own boards."""
    return max(0.02, 2 * LONGEST * _BITS / baud)


def wrong_baud(baud: int, dead_man: float) -> str:
    """Why a baud rate does not work for commands; empty if it does. ``dead_man`` in s."""
    if baud > _FASTEST:
        return f"an UNO cannot receive bytes at {baud} baud fast enough"
    made = made_baud(baud)
    if abs(made / baud - 1) > _OFF:
        return f"an UNO can only make {made:.0f} of {baud} baud, {made / baud - 1:+.1%}"
    seconds, period = COMMAND_BYTES * _BITS / baud, min(_REPEAT, dead_man / 2)
    if seconds > CAREFUL * period:
        return (
            f"a command takes {seconds * 1000:.0f} ms at {baud} baud, and is sent every "
            f"{period * 1000:.0f} ms for the dead-man of the board"
        )
    return ""


def good_bauds(known: Iterable[int], dead_man: float) -> list[int]:
    """Returns the baud rates of ``known`` that work on an UNO. ``dead_man`` in s."""
    return [one for one in known if not wrong_baud(one, dead_man)]


def most_pulses(wheel_speed_max: float, wheel_radius: float) -> int:
    """Returns the most pulses per turn of a wheel that the board can count at full speed (m/s, m)."""
    return int(PULSES_PER_SECOND * 2 * math.pi * wheel_radius / wheel_speed_max)
