"""How full a robot's battery is, and whether it is docked, by topics of its driver. Knows no ROS."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Callable, Mapping

_RECENT = 60.0  # s; many drivers publish their battery once in 10 s
#: Values of `power_supply_status` in sensor_msgs/BatteryState: discharging, not charging; charging, full.
_ELSEWHERE, _DOCKED = (2, 3), (1, 4)


@dataclass(frozen=True)
class _Seen:
    battery: float | None
    docked: bool | None
    arrived: float


class PowerWatch:
    """``battery`` and ``docked``: full names of topics, empty for none. ``take_*`` may run in any thread."""

    def __init__(self, battery: str, docked: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.battery = battery
        self.docked = docked
        self._clock = clock
        self._power: _Seen | None = None
        self._contact: _Seen | None = None

    def take_battery(self, percentage: float, status: int) -> None:
        """Takes a sensor_msgs/BatteryState. A share that is not from 0 to 1 says nothing, NaN included."""
        share = percentage if 0.0 <= percentage <= 1.0 else None
        docked = True if status in _DOCKED else False if status in _ELSEWHERE else None
        self._power = _Seen(share, docked, self._clock())

    def take_docked(self, docked: bool) -> None:
        """Takes a std_msgs/Bool that says whether the robot is docked; it counts more than its battery."""
        self._contact = _Seen(None, docked, self._clock())

    def state(self) -> Mapping[str, Any]:
        """Returns what is known now; None for what no recent message says."""
        power, contact = self._recent(self._power), self._recent(self._contact)
        dock = contact if self.docked else power
        return {"battery": power.battery if power else None, "docked": dock.docked if dock else None}

    def _recent(self, seen: _Seen | None) -> _Seen | None:
        return seen if seen is not None and self._clock() - seen.arrived <= _RECENT else None
