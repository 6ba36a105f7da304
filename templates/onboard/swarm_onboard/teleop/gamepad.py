"""Translates the state of a joystick: drive or stand still, and why. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Sequence

from swarm_onboard.common.systemd import WAITS
from swarm_onboard.teleop.driving import Twist

WAITING = f"{WAITS}the joystick"
LET_GO = f"{WAITS}the dead-man button to be let go"
READY = "ready: hold the dead-man button to drive"


@dataclass(frozen=True)
class Settings:
    """The settings of settings.yaml, which describes each."""

    topic: str
    device: str
    deadman_button: int
    linear_axis: int
    angular_axis: int
    linear_scale: float
    angular_scale: float
    turbo_button: int
    turbo_linear_scale: float
    turbo_angular_scale: float
    select_button: int
    dead_zone: float
    rate: float
    joy_timeout: float
    still_timeout: float


@dataclass(frozen=True)
class Pad:
    """A joystick. ``seen``: when it last proved to be there; ``changed``: when anything on it moved; in s."""

    axes: tuple[float, ...]
    buttons: tuple[int, ...]
    seen: float
    changed: float

    def held(self, button: int) -> bool | None:
        """Returns whether a button is held; None if there is no such button."""
        return bool(self.buttons[button]) if 0 <= button < len(self.buttons) else None


def noticed(before: Pad | None, axes: Sequence[float], buttons: Sequence[int], now: float) -> Pad:
    """The joystick after it reported its state."""
    same = before is not None and (before.axes, before.buttons) == (tuple(axes), tuple(buttons))
    return Pad(tuple(axes), tuple(buttons), now, before.changed if before is not None and same else now)


@dataclass(frozen=True)
class Hand:
    """The state between two readings. Not ``armed``: the dead-man button must be released first."""

    armed: bool = False
    selecting: bool = False
    chosen: int | None = None


def look(
    settings: Settings, robots: Sequence[str], hand: Hand, pad: Pad | None, now: float
) -> tuple[Hand, Twist | None, str]:
    """Returns the state after a reading, the wanted twist (None: stop), and the state as text."""
    if pad is None:
        return replace(hand, armed=False), None, WAITING
    if fault := _fault(settings, pad, now):
        return replace(hand, armed=False), None, f"{WAITING}: {fault}"
    if not pad.held(settings.deadman_button):
        hand = _selected(settings, len(robots), replace(hand, armed=True), pad)
        return hand, None, READY if hand.chosen is None else f"{READY} {robots[hand.chosen]}"
    if not hand.armed:
        return hand, None, LET_GO
    whom = ", ".join(robots) if hand.chosen is None else robots[hand.chosen]
    return hand, _twist(settings, pad), f"drives {whom}"


def _fault(settings: Settings, pad: Pad, now: float) -> str:
    """Why the joystick cannot be trusted; empty if it can."""
    if now - pad.seen > settings.joy_timeout:
        return (
            f"no message on `{settings.topic}` for {settings.joy_timeout:g} s; "
            "joy_node repeats what is held only with its parameter autorepeat_rate, such as 20"
        )
    for button in (settings.deadman_button, settings.turbo_button, settings.select_button):
        if button >= len(pad.buttons):
            return f"it has no button {button}, only {len(pad.buttons)}"
    for axis in (settings.linear_axis, settings.angular_axis):
        if axis >= len(pad.axes):
            return f"it has no axis {axis}, only {len(pad.axes)}"
        if not math.isfinite(pad.axes[axis]):
            return f"its axis {axis} is not a number"
    if 0 < settings.still_timeout < now - pad.changed and pad.held(settings.deadman_button):
        return f"nothing on it has changed for {settings.still_timeout:g} s"
    return ""


def _twist(settings: Settings, pad: Pad) -> Twist:
    turbo = pad.held(settings.turbo_button)
    linear = settings.turbo_linear_scale if turbo else settings.linear_scale
    angular = settings.turbo_angular_scale if turbo else settings.angular_scale
    return Twist(
        linear * _share(pad.axes[settings.linear_axis], settings.dead_zone),
        angular * _share(pad.axes[settings.angular_axis], settings.dead_zone),
    )


def _share(axis: float, dead_zone: float) -> float:
    """From -1 to 1; nothing in the dead zone, and no jump at its edge."""
    far = min(1.0, abs(axis))
    return 0.0 if far <= dead_zone else math.copysign((far - dead_zone) / (1.0 - dead_zone), axis)


def _selected(settings: Settings, robots: int, hand: Hand, pad: Pad) -> Hand:
    """All robots, then each by itself, then all again: one further each time the button goes down."""
    pressed = bool(pad.held(settings.select_button))
    if not pressed or hand.selecting:
        return replace(hand, selecting=pressed)
    following = 0 if hand.chosen is None else hand.chosen + 1
    return replace(hand, selecting=True, chosen=following if following < robots else None)
