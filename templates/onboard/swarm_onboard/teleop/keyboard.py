"""What keys mean: a move while one is held, another speed, or a stop. Pure.

Moves and scales are those of the second paper's Fig. 4: linear.x = x * speed, angular.z = th * turn.
A terminal reports no release: a key counts as held while its repeats come.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from swarm_onboard.teleop.driving import Twist

# x and th
_FORWARD, _BACKWARD, _LEFT, _RIGHT = (1, 0), (-1, 0), (0, 1), (0, -1)
MOVES = {"u": (1, 1), "o": (1, -1), "m": (-1, -1), ".": (-1, 1)}
MOVES.update({"i": _FORWARD, ",": _BACKWARD, "j": _LEFT, "l": _RIGHT})
MOVES.update({"up": _FORWARD, "down": _BACKWARD, "left": _LEFT, "right": _RIGHT})
# of speed and of turn
CHANGES = {"q": (1, 1), "z": (-1, -1), "w": (1, 0), "x": (-1, 0), "e": (0, 1), "c": (0, -1)}
END = "\x04"  # Ctrl-D
BURST = 12  # keys at once come from a connection that was stuck: nobody presses them now

HELP = """
   u  i  o      forward          q / z   all speeds up / down
   j  k  l      turn, stop       w / x   speed up / down
   m  ,  .      backward         e / c   turning up / down
   or arrows                     0, 1-9  all robots, one of them
Hold a key to drive. k, space and any other key stop. Ctrl-D ends.
"""

_ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
# An arrow; any other sequence (ECMA-48, and SS3 of a terminal's application mode); Escape itself; one byte.
_KEY = re.compile(rb"\x1b[\[O](?P<arrow>[A-D])|\x1b\[[ -?]*[^ -?]|\x1bO.|\x1b(?=[^\[O])|[^\x1b]", re.DOTALL)


@dataclass(frozen=True)
class Settings:
    """The settings of settings.yaml, which describes each, and the range of speeds."""

    speed: float
    turn: float
    speed_step: float
    turn_step: float
    first_hold: float
    hold: float
    rate: float
    speed_bounds: tuple[float, float]
    turn_bounds: tuple[float, float]


@dataclass(frozen=True)
class Keys:
    """The state of the keyboard. ``held`` is a key of MOVES, ``until`` when it counts as released."""

    speed: float
    turn: float
    held: str = ""
    until: float = 0.0
    chosen: int | None = None

    def twist(self, now: float) -> Twist | None:
        """Returns the wanted twist; None if no key is held."""
        if not self.held or now >= self.until:
            return None
        x, th = MOVES[self.held]
        return Twist(x * self.speed, th * self.turn)


def decoded(data: bytes) -> tuple[list[str], bytes]:
    """Returns the keys in what a terminal sent, and the beginning of an incomplete sequence."""
    keys, place = [], 0
    while place < len(data):
        found = _KEY.match(data, place)
        if found is None:
            break
        place = found.end()
        arrow = found["arrow"]
        keys.append(_ARROWS[arrow] if arrow else found[0].decode("latin-1").lower())
    return keys, data[place:]


def pressed(settings: Settings, robots: int, keys: Keys, new: list[str], now: float) -> Keys:
    """Returns the state after ``new`` keys arrived at once."""
    if len(new) > BURST:
        return replace(keys, held="")
    for key in new:
        keys = _pressed(settings, robots, keys, key, now)
    return keys


def _pressed(settings: Settings, robots: int, keys: Keys, key: str, now: float) -> Keys:
    if key in MOVES:
        repeated = key == keys.held and now < keys.until
        until = max(keys.until, now + settings.hold) if repeated else now + settings.first_hold
        return replace(keys, held=key, until=until)
    if key in CHANGES:
        speed, turn = CHANGES[key]
        return replace(
            keys,
            speed=_within(settings.speed_bounds, keys.speed * (1 + speed * settings.speed_step)),
            turn=_within(settings.turn_bounds, keys.turn * (1 + turn * settings.turn_step)),
        )
    if key.isdecimal() and int(key) <= robots:
        return replace(keys, held="", chosen=int(key) - 1 if key != "0" else None)
    return replace(keys, held="")


def _within(bounds: tuple[float, float], value: float) -> float:
    return min(bounds[1], max(bounds[0], value))


def line(robots: tuple[str, ...], keys: Keys, now: float, width: int) -> str:
    """Returns the state as one line of a terminal."""
    whom = ", ".join(robots) if keys.chosen is None else robots[keys.chosen]
    state = f"drives ({keys.held})" if keys.twist(now) else "stopped"
    text = f"{state:14} speed {keys.speed:.2f} m/s  turn {keys.turn:.2f} rad/s  {whom}"
    return text if len(text) < width else text[: max(0, width - 4)] + "..."
