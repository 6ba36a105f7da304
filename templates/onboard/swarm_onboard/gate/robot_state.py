"""The state of a robot by the topics of its driver: whether it stands, its battery, its dock."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from typing import Any, Callable, Mapping

from swarm_onboard.command.battery_watch import BatteryWatch

_RECENT_POWER = 60.0  # s; many drivers publish their battery once in 10 s
#: Values of `power_supply_status` in sensor_msgs/BatteryState: discharging, not charging; charging, full.
_ELSEWHERE, _DOCKED = (2, 3), (1, 4)


@dataclass(frozen=True)
class _SeenPower:
    docked: bool | None
    arrived: float


class PowerWatch:
    """``battery`` and ``docked``: full names of topics, empty for none. ``take_*`` may run in any thread."""

    def __init__(
        self, battery: str, docked: str, charge: BatteryWatch, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.battery = battery
        self.charge = charge
        self.docked = docked
        self._clock = clock
        self._power: _SeenPower | None = None
        self._contact: _SeenPower | None = None

    def take_battery(self, percentage: float, status: int) -> None:
        """Takes a sensor_msgs/BatteryState. A share that is not from 0 to 1 says nothing, NaN included."""
        self.charge.take(percentage if 0.0 <= percentage <= 1.0 else None, _RECENT_POWER)
        docked = True if status in _DOCKED else False if status in _ELSEWHERE else None
        self._power = _SeenPower(docked, self._clock())

    def take_docked(self, docked: bool) -> None:
        """Takes a std_msgs/Bool that says whether the robot is docked; it counts more than its battery."""
        self._contact = _SeenPower(docked, self._clock())

    def state(self) -> Mapping[str, Any]:
        """Returns what is known now; None for what no recent message says."""
        dock = self._contact if self.docked else self._power
        recent = dock is not None and self._clock() - dock.arrived <= _RECENT_POWER
        return {"battery": self.charge.share(), "docked": dock.docked if dock and recent else None}


SLOWEST = 0.02  # m/s, and rad/s: what is not faster counts as standing
SHOWN_FOR = 0.3  # s of readings after the zero that show it
_WAY = SLOWEST * SHOWN_FOR  # m, and rad, that the pose may differ within them
_WANTED_FOR = 5.0  # s after the latest question
_FIRST_WITHIN = 1.5  # s for the first reading to arrive
_RECENT = 1.0  # s
_BRAKES_FOR = 1.0  # s after the zero in which a robot may still move


@dataclass(frozen=True)
class Reading:
    """Pose in m and rad, speeds in m/s and rad/s, and its arrival by the gate's clock."""

    x: float
    y: float
    z: float
    yaw: float
    speed: float
    turn: float
    arrived: float

    def near(self, other: Reading) -> bool:
        """Returns True if the pose differs by less than a robot that stands may show."""
        way = math.hypot(math.hypot(self.x - other.x, self.y - other.y), self.z - other.z)
        return way <= _WAY and abs(math.remainder(self.yaw - other.yaw, 2 * math.pi)) <= _WAY


class OdometryWatch:
    """``ask`` and ``motion`` belong to the gate's thread, the rest to those of ROS."""

    def __init__(self, topic: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.topic = topic
        self.requested = threading.Event()
        self._clock = clock
        self._began = self._until = -math.inf
        self._seen: _Seen | None = None

    def wanted(self) -> bool:
        """Returns True while readings are wanted."""
        return self._clock() < self._until

    def take(self, reading: Reading) -> None:
        """Takes a reading as it arrives."""
        seen = self._seen
        if seen is not None and _slow(reading) and _slow(seen.first) and seen.first.near(reading):
            self._seen = _Seen(seen.first, reading, moves=False)
        else:
            self._seen = _Seen(reading, reading, moves=seen is not None or not _slow(reading))

    def ask(self) -> None:
        """Has readings taken for a while."""
        now = self._clock()
        if now >= self._until:
            self._began, self._seen = now, None
        self._until = now + _WANTED_FOR
        self.requested.set()

    def motion(self, zero_since: float | None) -> Mapping[str, Any]:
        """Returns whether the robot moves, as the gate answers it. ``pending``: it is not known yet.

        ``zero_since``: since when the driver has been sent nothing but zeros.
        """
        now, seen = self._clock(), self._seen
        found: dict[str, Any] = {"measured": False, "still_since": None, "pending": False}
        if seen is None or now - seen.latest.arrived > _RECENT:
            if now - self._began <= _FIRST_WITHIN:
                return {**found, "pending": True}
            return {**found, "trouble": f"no odometry arrives on {self.topic}"}
        latest = seen.latest
        found.update(measured=True, by="odometry", pose=[latest.x, latest.y, latest.yaw])
        found.update(driven=[latest.speed, latest.turn])
        begun = max(seen.first.arrived, zero_since) if zero_since is not None else math.inf
        if seen.latest.arrived - begun >= SHOWN_FOR:
            return {**found, "still_since": seen.first.arrived}
        if zero_since is None:  # it moves as it is commanded
            return found
        if not seen.moves or now - zero_since < _BRAKES_FOR:
            return {**found, "pending": True}
        speeds = f"{seen.latest.speed:.2f} m/s, {seen.latest.turn:.2f} rad/s"
        return {**found, "trouble": f"it moves by its odometry, which has {speeds}"}


@dataclass(frozen=True)
class _Seen:
    """The first of the readings that do not differ, and the latest. ``moves``: that one differs."""

    first: Reading
    latest: Reading
    moves: bool


def _slow(reading: Reading) -> bool:
    return reading.speed <= SLOWEST and abs(reading.turn) <= SLOWEST
