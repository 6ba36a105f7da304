"""``telemetry``: how the robots of the host move, several times a second, as their drivers and gates know it.

Asks them over their sockets: nothing joins the graph of ROS, and no message of it is read.
"""

from __future__ import annotations

import os
import time
from functools import partial

from swarm_onboard.agent import control_groups, json_text, robot_motion, trial_guard
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.texts import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Mapping

_FASTEST, _LONGEST = 0.05, 60.0  # s
_ANSWERS_WITHIN = 0.05  # s
_DIGITS = 4


class Request(NamedTuple):
    """Every ``period`` s, for ``seconds``: how all robots of the host move, and whether ``devices`` exist.

    ``devices``: the path of each robot's.
    """

    swarm: str
    devices: dict[str, str]
    period: float
    seconds: float


class RobotTelemetry(NamedTuple):
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


class Telemetry(NamedTuple):
    """A note: the robots that answer, those whose device is ``missing``, the ``units`` that run.

    ``trial``: the name of the one that goes on, or empty text; ``left``: s until its end.
    """

    robots: dict[str, RobotTelemetry]
    missing: list[str]
    units: list[str]
    trial: str
    left: float


class Answer(NamedTuple):
    """``sent``: the number of notes."""

    sent: int


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Sends a note, a ``Telemetry`` as JSON, every ``period`` s for ``seconds``."""
    home = home_of(request.swarm)
    period = max(_FASTEST, float(request.period))
    due = time.monotonic()
    end = due + min(_LONGEST, float(request.seconds))
    sent = 0
    while due < end:
        sockets = robot_motion.sockets(home)
        answers = robot_motion.ask(sockets, _ANSWERS_WITHIN, partial(_all_of, len(sockets)))
        trial = trial_guard.going_on(home)
        note = Telemetry(
            {robot: _of(answer) for robot, answer in answers.items()},
            [robot for robot, path in request.devices.items() if not os.path.exists(path)],
            list(control_groups.of_swarm(home.swarm)),
            trial.name if trial is not None else "",
            round(max(0.0, trial.left(home) - trial_guard.GRACE), 1) if trial is not None else 0.0,
        )
        report.note(json_text.dumps(note))
        sent += 1
        due = max(due + period, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    return Answer(sent)


def _all_of(count: int, answers: Mapping[str, Any]) -> bool:
    return len(answers) == count


def _of(answer: Mapping[str, Any]) -> RobotTelemetry:
    return RobotTelemetry(
        _numbers(answer.get("pose"), 3),
        _numbers(answer.get("driven"), 2),
        _numbers(answer.get("commanded"), 2),
        clipped(answer.get("commander", "")),
        clipped(answer.get("trouble", "")),
        bool(answer.get("held")),
        None if (charge := answer.get("battery")) is None else round(float(charge), _DIGITS),
    )


def _numbers(value: Any, count: int) -> list[float] | None:
    if not isinstance(value, list) or len(value) != count:
        return None
    return [round(float(one), _DIGITS) for one in value]
