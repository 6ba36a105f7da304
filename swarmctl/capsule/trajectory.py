"""How a robot moved in a trial: samples of its pose, and what follows from them. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import atan2, cos, hypot, inf, pi, sin
from typing import Any, NamedTuple

_STEP = 0.005  # m: encoders and cameras that look at a standing robot are quieter


class Sample(NamedTuple):
    """Time, s since 1970; x and y, m; yaw, rad; driven speed, m/s, forwards, None where no message has it."""

    t: float
    x: float
    y: float
    yaw: float
    speed: float | None = None


def planar(pose: Any) -> tuple[float, float, float]:
    """Returns x and y, m, and yaw, rad, of a ``geometry_msgs/msg/Pose``.

    Yaw is the rotation about z of the quaternion's angles in the order z, y, x (REP 103).
    """
    place, turn = pose.position, pose.orientation
    yaw = atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y * turn.y + turn.z * turn.z))
    return float(place.x), float(place.y), yaw


@dataclass
class RecordedTopic:
    """The number of messages of a topic, and the samples of those with a pose, in the order of time.

    ``recorder``: the host whose bags they are of, with times by its clock. Poses of ``odometry`` count from
    anywhere: the robot's driver decides where it began.
    """

    messages: int = 0
    odometry: bool = False
    samples: list[Sample] = field(default_factory=list)
    recorder: str = ""

    def trajectory(self) -> list[Sample]:
        """Returns the samples, those of odometry as seen from the first of them."""
        return from_start(self.samples) if self.odometry else self.samples


def from_start(samples: Sequence[Sample]) -> list[Sample]:
    """Returns the samples in the frame of the first: it is at the origin, and x is ahead of it."""
    if not samples:
        return []
    _, x, y, yaw, _ = samples[0]
    along, across = cos(yaw), sin(yaw)
    return [
        Sample(
            one.t,
            along * (one.x - x) + across * (one.y - y),
            along * (one.y - y) - across * (one.x - x),
            (one.yaw - yaw + pi) % (2 * pi) - pi,
            one.speed,
        )
        for one in samples
    ]


def nearest(samples: Sequence[Sample], x: float, y: float) -> float:
    """Returns the least distance of a sample to a point, m; infinite without samples."""
    return min((hypot(one.x - x, one.y - y) for one in samples), default=inf)


def path_length(samples: Sequence[Sample]) -> float:
    """Returns the length of the path, m: of straight lines between its corners.

    A corner is the first sample that is 5 mm or more from the corner before; the last sample is one, too.
    So noise below that adds up to less than 5 mm while a robot stands, and slow driving, whose single steps
    are as short, adds up in full.
    """
    length, corner = 0.0, None
    for one in samples:
        if corner is None:
            corner = one
        elif (step := hypot(one.x - corner.x, one.y - corner.y)) >= _STEP:
            length, corner = length + step, one
    return length + hypot(samples[-1].x - corner.x, samples[-1].y - corner.y) if corner else length
