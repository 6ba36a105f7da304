"""Requests and answers of verbs that stop, release, restart and watch robots. JSON objects; types only."""

from __future__ import annotations

from typing import Literal, TypedDict


class StopRequest(TypedDict):
    """Latch ``robots`` so that they stand; with ``others`` those too that run here and are not named.

    ``patience``: s to wait until their wheels are confirmed to stand.
    """

    verb: Literal["stop"]
    swarm: str
    who: str
    robots: list[str]
    others: bool
    patience: float


class RobotMotion(TypedDict):
    """What is known of one robot, s since the request began.

    ``latched``: it stays so until ``start``; ``runs``: its driver or gate answered. ``proof``: `wheels` stand
    by their counters, or the robot by the `odometry` of its driver; it `confirmed` the zero, the zero was
    `sent`, or `none`; ``seconds``: when, 0 if before the request; ``commander``: who commanded it then;
    ``trouble``: why there is no more proof.
    """

    latched: bool
    runs: bool
    proof: Literal["wheels", "odometry", "confirmed", "sent", "none"]
    seconds: float | None
    commander: str
    trouble: str


class StopAnswer(TypedDict):
    """``deployed``: the swarm is on the host; ``elapsed``: s that the request took on the host."""

    deployed: bool
    elapsed: float
    robots: dict[str, RobotMotion]


class StartRequest(TypedDict):
    """Release ``robots``, with ``others`` all that are latched here."""

    verb: Literal["start"]
    swarm: str
    robots: list[str]
    others: bool


class StartAnswer(TypedDict):
    """``released``: the robots that were latched."""

    deployed: bool
    released: list[str]


class RestartNeeds(TypedDict):
    """The required keys of ``restart``."""

    verb: Literal["restart"]
    swarm: str
    robots: list[str]
    others: bool


class RestartRequest(RestartNeeds, total=False):
    """Restart the units of ``robots``, with ``others`` of all robots here. ``who``, ``wait``, ``run`` and
    ``stop_robots`` as in ``messages.Locking``."""

    who: str
    wait: float
    run: str
    stop_robots: bool


class RestartAnswer(TypedDict):
    """``restarted``: the units, which run again."""

    deployed: bool
    restarted: list[str]


class MotionRequest(TypedDict):
    """Which of ``robots`` are in use; with ``stop`` they are latched first and must be confirmed to stand."""

    verb: Literal["motion"]
    swarm: str
    who: str
    robots: list[str]
    stop: bool


class RobotUse(TypedDict):
    """``why`` a robot counts as in use, as the end of a sentence about it; its ``commander``, or empty."""

    why: str
    commander: str


class MotionAnswer(TypedDict):
    """``in_use``: the robots that move or are under command, and are not stopped; by robot."""

    in_use: dict[str, RobotUse]


class TelemetryRequest(TypedDict):
    """Every ``period`` s, for ``seconds``: how all robots of the host move, and whether ``devices`` exist.

    ``devices``: the path of each robot's.
    """

    verb: Literal["telemetry"]
    swarm: str
    devices: dict[str, str]
    period: float
    seconds: float


class RobotTelemetry(TypedDict):
    """How a robot moves. ``pose``: x and y in m, yaw in rad, by its odometry; ``driven`` and ``commanded``:
    m/s and rad/s; ``battery``: how full, 0 to 1. None: not known. ``held`` by ``swarmctl stop``;
    ``trouble``: as in ``RobotMotion``.
    """

    pose: list[float] | None
    driven: list[float] | None
    commanded: list[float] | None
    commander: str
    trouble: str
    held: bool
    battery: float | None


class Telemetry(TypedDict):
    """A note: the robots that answer, those whose device is ``missing``, the ``units`` that run."""

    robots: dict[str, RobotTelemetry]
    missing: list[str]
    units: list[str]


class TelemetryAnswer(TypedDict):
    """``sent``: the number of notes."""

    sent: int
