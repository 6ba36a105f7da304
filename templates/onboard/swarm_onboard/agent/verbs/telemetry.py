"""``telemetry``: how the robots of the host move, several times a second, as their drivers and gates know it.

Asks them over their sockets: nothing joins the graph of ROS, and no message of it is read.
"""

from __future__ import annotations

import os
import time
from functools import partial

from swarm_onboard.agent import control_groups, json_text, robot_motion
from swarm_onboard.agent.clip import clipped
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Mapping

    from swarm_onboard.agent.motion_messages import RobotTelemetry, TelemetryAnswer, TelemetryRequest

_FASTEST, _LONGEST = 0.05, 60.0  # s
_ANSWERS_WITHIN = 0.05  # s
_DIGITS = 4


def handle(request: TelemetryRequest, payload: bytes, report: Report) -> TelemetryAnswer:
    """Sends a note, a ``Telemetry`` as JSON, every ``period`` s for ``seconds``."""
    home = home_of(request["swarm"])
    period = max(_FASTEST, float(request["period"]))
    due = time.monotonic()
    end = due + min(_LONGEST, float(request["seconds"]))
    sent = 0
    while due < end:
        sockets = robot_motion.sockets(home)
        answers = robot_motion.ask(sockets, _ANSWERS_WITHIN, partial(_all_of, len(sockets)))
        note = {
            "robots": {robot: _of(answer) for robot, answer in answers.items()},
            "missing": [robot for robot, path in request["devices"].items() if not os.path.exists(path)],
            "units": list(control_groups.of_swarm(home.swarm)),
        }
        report.note(json_text.dumps(note))
        sent += 1
        due = max(due + period, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    return {"sent": sent}


def _all_of(count: int, answers: Mapping[str, Any]) -> bool:
    return len(answers) == count


def _of(answer: Mapping[str, Any]) -> RobotTelemetry:
    return {
        "pose": _numbers(answer.get("pose"), 3),
        "driven": _numbers(answer.get("driven"), 2),
        "commanded": _numbers(answer.get("commanded"), 2),
        "commander": clipped(answer.get("commander", "")),
        "trouble": clipped(answer.get("trouble", "")),
        "held": bool(answer.get("held")),
        "battery": None if (charge := answer.get("battery")) is None else round(float(charge), _DIGITS),
    }


def _numbers(value: Any, count: int) -> list[float] | None:
    if not isinstance(value, list) or len(value) != count:
        return None
    return [round(float(one), _DIGITS) for one in value]
