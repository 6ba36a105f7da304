"""Asks the drivers and gates that run on the host whether their robots stand, and who commands them."""

from __future__ import annotations

import os
import select
import time
from contextlib import ExitStack, suppress

from . import json_text
from .named_tuple import NamedTuple
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    import socket
    from typing import Any, Callable, Iterable, Literal, Mapping

SOCKET = "motion"
GATE = "gate"
STILL_TURN = "its wheels still turned"
_AGAIN = 0.02  # s between two questions
_LONGEST = 8192  # bytes of an answer


class RobotMotion(NamedTuple):
    """What is known of one robot, s since the request began.

    ``latched``: it stays so until ``start``; ``runs``: its driver or gate answered. ``proof``: `wheels` stand
    by their counters, or the robot by the `odometry` of its driver; it `confirmed` the zero, the zero was
    `sent`, or `none`; ``seconds``: when, 0 if before the request; ``commander``: who commanded it then;
    ``trouble``: why there is no more proof.
    """

    latched: bool
    runs: bool
    proof: Literal["wheels", "odometry", "confirmed", "sent", "none"] = "none"
    seconds: float | None = None
    commander: str = ""
    trouble: str = ""


def sockets(home: Home) -> dict[str, str]:
    """Returns the socket of each robot whose driver or gate runs, by robot; a gate before its driver."""
    found: dict[str, str] = {}
    run, prefix = home.outside("/run"), f"swarm-{home.swarm}."
    with suppress(OSError):
        for folder in sorted(os.listdir(run)):
            robot, _, part = folder[len(prefix) :].partition(".")
            path = f"{run}/{folder}/{SOCKET}"
            if folder.startswith(prefix) and part in ("", GATE) and os.path.exists(path):
                found[robot] = path
    return found


def guarded(home: Home, robot: str) -> bool:
    """Returns True if the current release has a driver of swarmctl, or a gate, for ``robot``."""
    params = f"{home.current_link}/params/{robot}"
    return any(os.path.exists(f"{params}{part}.yaml") for part in ("", f".{GATE}"))


def ask(
    paths: Mapping[str, str],
    patience: float = 0.0,
    enough: Callable[[Mapping[str, Mapping[str, Any]]], bool] = lambda _: False,
    question: str = "?",
) -> dict[str, Mapping[str, Any]]:
    """Asks until the latest answers are ``enough``, for at most ``patience`` s; returns them as in ``paths``.

    Asks once at least, which makes drivers and gates look at their latches.
    """
    answers: dict[str, Mapping[str, Any]] = {}
    end = time.monotonic() + patience
    with ExitStack() as open_ones:
        own = {robot: open_ones.enter_context(_asking()) for robot in paths}
        while True:
            for robot, path in paths.items():
                with suppress(OSError):  # its driver has just ended, or has questions enough
                    own[robot].sendto(question.encode("ascii"), path)
            again = min(end, time.monotonic() + _AGAIN)
            while own and not enough(answers) and (left := again - time.monotonic()) > 0:
                ready, _, _ = select.select(list(own.values()), [], [], left)
                for robot in [one for one, channel in own.items() if channel in ready]:
                    answer = _read(own[robot])
                    if answer is not None:
                        answers[robot] = answer
            if not own or enough(answers) or time.monotonic() >= end:
                return answers


def wake(home: Home, robots: Iterable[str]) -> None:
    """Makes the drivers and gates of ``robots`` look at their latches, as far as they run."""
    running = sockets(home)
    ask({one: running[one] for one in robots if one in running})


def motion(robot_answer: Mapping[str, Any] | None, began: float, *, latched: bool) -> RobotMotion:
    """Returns what an answer says of a robot; none: its driver did not answer."""
    if robot_answer is None:
        return RobotMotion(latched, False, trouble="its driver does not run, or does not answer")
    still, zero = robot_answer.get("still_since"), robot_answer.get("zero_at")
    moment = still if still is not None else zero
    trouble = str(robot_answer.get("trouble", ""))
    found = RobotMotion(
        latched,
        True,
        seconds=None if moment is None else round(max(0.0, float(moment) - began), 3),
        commander=str(robot_answer.get("commander", "")),
        trouble=trouble,
    )
    if latched and not robot_answer.get("held"):
        return found._replace(
            trouble=trouble or "its driver has not seen the latch: is it of an older release?"
        )
    if still is not None:
        return found._replace(proof="odometry" if robot_answer.get("by") == "odometry" else "wheels")
    if zero is not None:
        measured = STILL_TURN if robot_answer.get("measured") else "its wheels are not measured"
        found = found._replace(trouble=trouble or measured)
        return found._replace(proof="confirmed" if robot_answer.get("confirms") else "sent")
    return found


def _asking() -> socket.socket:
    """A socket with an abstract name, so that an account without rights on any folder can answer."""
    import socket  # noqa: PLC0415  (takes long to load, and not every host has a driver that runs)

    made = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    made.setblocking(False)
    made.bind("\0swarm-motion-" + os.urandom(12).hex())
    return made


def _read(channel: socket.socket) -> Mapping[str, Any] | None:
    """The latest answer."""
    latest = None
    with suppress(BlockingIOError):
        while True:
            latest = channel.recv(_LONGEST)
    try:
        value = json_text.loads((latest or b"").decode("utf-8"))
    except ValueError:
        return None
    return value if isinstance(value, dict) else None


def proven(answers: Mapping[str, Mapping[str, Any]], robots: Iterable[str]) -> bool:
    """Returns True if all ``robots`` are held and their wheels stand, or cannot be measured at all."""
    return all(_final(answers.get(one)) for one in robots)


def _final(answer: Mapping[str, Any] | None) -> bool:
    if answer is None or not answer.get("held") or answer.get("pending"):
        return False
    if answer.get("measured"):
        return answer.get("still_since") is not None
    return answer.get("zero_at") is not None
