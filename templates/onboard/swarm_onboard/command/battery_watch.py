"""How full the battery is, and whether the robot takes commands with it. Knows no ROS."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, Callable, Mapping

from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.report import Level

# A motor that starts pulls the voltage down for a second or so; a slow topic has one odd message at times.
_LASTING = 5.0  # s, and
_READINGS = 3  # in a row, until a battery counts as empty, or no longer as that


@dataclass(frozen=True)
class BatteryLimits:
    """Shares of a full battery: it is reported below ``low``, and below ``empty`` the robot stands."""

    low: float = 0.0
    empty: float = 0.0


def battery_limits_of(data: Mapping[str, Any]) -> BatteryLimits:
    """Returns the value of `battery_limits`. Raises ``KeyError``, ``TypeError`` or ``ValueError``."""
    limits = BatteryLimits(float(data["low"]), float(data["empty"]))
    if not 0.0 < limits.empty < limits.low < 1.0:
        raise ValueError("`battery_limits`: 0 < empty < low < 1")
    return limits


NO_LIMITS = BatteryLimits()


class BatteryWatch:
    """Lets the robot of ``commands`` stand while its battery is empty, until that is no longer low."""

    def __init__(
        self, limits: BatteryLimits, commands: CommandMailbox, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._limits = limits
        self._commands = commands
        self._clock = clock
        self._share = math.nan
        self._until = -math.inf
        self._since = math.inf
        self._readings = 0  # in a row, that say the opposite of what counts

    def take(self, share: float | None, recent: float) -> None:
        """Takes a reading, 0 to 1, ``recent`` for so long, s. None, an unknown one, changes no state."""
        now = self._clock()
        if share is None:
            self._until = -math.inf
            return
        self._share, self._until = share, now + recent
        empty = self._commands.battery_empty
        if share < self._limits.low if empty else share >= self._limits.empty:
            self._readings = 0
            return
        self._since = now if not self._readings else self._since
        self._readings += 1
        if self._readings >= _READINGS and now - self._since >= _LASTING:
            self._commands.hold_empty(empty=not empty)
            self._readings = 0

    def share(self) -> float | None:
        """Returns how full the battery is by the latest reading, 0 to 1; None without one that is recent."""
        return self._share if self._clock() <= self._until else None

    def complaints(self) -> list[str]:
        """Returns what is wrong with the battery, if anything is."""
        share, low = self.share(), self._limits.low
        if self._commands.battery_empty:
            return [f"battery empty: {self._share:.0%}, takes no command until {low:.0%}"]
        return [f"battery low: {share:.0%}, low is {low:.0%}"] if share is not None and share < low else []

    def level(self) -> Level:
        """Returns how bad it is."""
        if self._commands.battery_empty:
            return Level.ERROR
        return Level.WARN if self.complaints() else Level.OK
