"""Odometry from two topics of a sketch: how far each wheel has turned, as whole numbers that wrap. Pure."""

from __future__ import annotations

import math
from dataclasses import replace

from swarm_onboard.driver.config import Kinematics, Scale
from swarm_onboard.driver.kinematics import TRUSTED_SHARE, Counters, Odometry, Pose
from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.rosserial.messages import INTEGERS, integer
from swarm_onboard.rosserial.topics import Topic

_APART = 0.03  # s between both counts of a pair at most: two frames, and an adapter that holds one back
_BITS = {"std_msgs/Int16": 16, "std_msgs/Int32": 32}


class Wheels:
    """Pairs the counts of both wheels and computes a pose from each pair, if the sketch counts at all.

    A count whose other half does not arrive in time is not paired with that of the next turn.
    """

    def __init__(self, protocol: RosserialProtocol, kinematics: Kinematics, odometry: Odometry) -> None:
        ticks = protocol.ticks
        self.odometry = odometry
        self._sides = (ticks.left, ticks.right) if ticks else ()
        self.kinematics = kinematics
        way = 2 * math.pi * ticks.wheel_radius / ticks.counts_per_turn if ticks else 0.0
        self.scale = Scale(firmware_below=math.inf, speed_units_per_mps=1.0, metres_per_count=way)
        self._counts: dict[str, int] = {}
        fastest = max((protocol.rates[side] for side in self._sides), default=1.0)
        self._trusted = TRUSTED_SHARE / fastest  # s
        self._apart = min(_APART, 0.5 / fastest)  # s
        self._begun = 0.0  # when the first half of a pair came

    def forget(self) -> None:
        """Drops the counts: the board starts to count anew."""
        self.odometry, self._counts = self.odometry.forget(), {}

    def take(self, topic: Topic, message: bytes, arrived: float) -> Pose | None:
        """Returns the new pose if ``message`` completes a pair, else None. Raises BadMessageError."""
        if topic.name not in self._sides or topic.type not in INTEGERS:
            return None
        if not self._counts or arrived - self._begun > self._apart:
            self._counts, self._begun = {}, arrived
        self._counts[topic.name] = integer(topic.type, message)
        if len(self._counts) < 2:
            return None
        left, right = (self._counts[side] for side in self._sides)
        counters = Counters(left, right, arrived)
        self._counts = {}
        kinematics = replace(self.kinematics, counter_bits=_BITS[topic.type])
        self.odometry = self.odometry.update(counters, kinematics, self.scale, self._trusted)
        return self.odometry.pose
