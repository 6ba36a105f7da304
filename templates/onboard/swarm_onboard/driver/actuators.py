"""Wanted states of lights, sounds and other actuators. Set from any thread, sent one request at a time."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Callable, Sequence, Tuple

from swarm_onboard.driver.config import Actuator

Key = Tuple[str, int]


@dataclass(frozen=True)
class Setting:
    """A value for each channel, and when it came."""

    values: tuple[int, ...]
    stamp: float


class ActuatorSettings:
    """The latest setting for each actuator. A setting is replaced as a whole, so threads need no lock."""

    def __init__(
        self,
        actuators: Sequence[Actuator],
        ring: Callable[[], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.actuators = actuators
        self.settings: dict[str, Setting] = {}
        self.refused = 0
        self._ring = ring
        self._clock = clock

    def put(self, actuator: Actuator, values: Sequence[int]) -> None:
        """Stores one value per channel, clamped to the range. Another number of values is refused."""
        if len(values) != len(actuator.channels):
            self.refused += 1
            return
        within = tuple(min(max(0, int(value)), actuator.max) for value in values)
        self.settings[actuator.name] = Setting(within, self._clock())
        self._ring()


@dataclass(frozen=True)
class Change:
    """The next request to send: all ``values`` of an actuator, or that of the channel ``index``."""

    actuator: Actuator
    index: int
    values: tuple[int, ...]
    meaning: tuple[float, ...]


class SentSettings:
    """The settings that one connection has sent. A new connection sends all again, except momentary ones."""

    def __init__(self, outputs: ActuatorSettings, since: float) -> None:
        self._outputs = outputs
        self._since = since
        self._sent: dict[Key, tuple[float, ...]] = {}

    def next(self) -> Change | None:
        """Returns the first setting that the robot does not show yet, or None."""
        for actuator in self._outputs.actuators if self._outputs.settings else ():
            setting = self._outputs.settings.get(actuator.name)
            if setting is None or (actuator.momentary and setting.stamp < self._since):
                continue
            for index in range(1 if actuator.at_once else len(setting.values)):
                meaning: tuple[float, ...] = setting.values if actuator.at_once else (setting.values[index],)
                if actuator.momentary:
                    meaning = (*meaning, setting.stamp)
                if self._sent.get((actuator.name, index)) != meaning:
                    return Change(actuator, index, setting.values, meaning)
        return None

    def mark_sent(self, change: Change) -> None:
        """Records ``change`` as sent."""
        self._sent[change.actuator.name, change.index] = change.meaning
