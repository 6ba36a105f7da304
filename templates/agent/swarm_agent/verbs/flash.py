"""``flash``: write a firmware to a robot's board while its driver stands aside, and hear what the board says.

Request: ``swarm``, ``who``, ``wait``, ``unit`` (the driver's), ``port``, ``write`` (avrdude's command, with
``{}`` for the firmware's file), ``digest`` (of the firmware), ``patience`` (s). Payload: Intel HEX.
Answer: ``written``; ``told``, whether the driver has then heard the board name that digest.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import time
from typing import Any, Sequence

from swarm_agent import lock, systemd
from swarm_agent.errors import FailedError, RefusedError
from swarm_agent.home import Home
from swarm_agent.manifest import swarm_name
from swarm_agent.wire import Report

_WRITING = 120  # s
_LOOK_EVERY = 0.5
# What avrdude says, and what that means to the person at the robot.
_TROUBLES = (
    ("programmer is not responding", "the board's boot loader does not answer on {}"),
    ("not in sync", "the board's boot loader does not answer on {}"),
    ("verification", "what the board holds now is not what was written to it"),
    ("Device signature", "the board on {} has another processor"),
    ("ermission denied", "{} cannot be opened: permission denied"),
    ("esource busy", "{} is in use by another program"),
)
_HINT = "is it the right board, speed (--speed) and cable? its reset button helps one that hangs"


def handle(request: dict[str, Any], payload: bytes, report: Report) -> dict[str, Any]:
    home = Home(swarm_name(request["swarm"]), os.environ.get("SWARM_PREFIX", ""))
    port, unit = str(request["port"]), str(request["unit"])
    command = [str(word) for word in request["write"]]
    if shutil.which(command[0]) is None:
        raise RefusedError(f"{command[0]} is missing", f"sudo apt install {command[0]}")
    if not os.path.exists(home.outside(port)):
        raise RefusedError(f"there is no {port}", "is the board's cable in, and was the swarm deployed?")
    with lock.held(home, str(request.get("who", ""))[:200], min(float(request.get("wait", 2)), 60)):
        report.detach()
        runs = systemd.running([unit])
        if runs:
            report.note(f"stop {unit}")
            systemd.stop(runs)
        try:
            report.note("write the firmware")
            _write(command, payload, port)
        finally:
            began = time.time()
            if runs:
                report.note(f"start {unit}")
                systemd.start(runs)
    if not runs:
        return {"written": True, "told": False}
    report.note("wait for the board to name its firmware")
    awaited = "swarmctl firmware " + str(request["digest"])
    return {"written": True, "told": _heard(unit, awaited, began, min(float(request["patience"]), 120))}


def _write(command: Sequence[str], firmware: bytes, port: str) -> None:
    with tempfile.NamedTemporaryFile(suffix=".hex") as file:
        file.write(firmware)
        file.flush()
        try:
            done = subprocess.run(
                [word.replace("{}", file.name) for word in command],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=_WRITING,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise FailedError(f"{command[0]} did not end within {_WRITING} s", _HINT) from None
    if done.returncode != 0:
        said = done.stdout.decode("utf-8", "replace")
        known = (meaning.format(port) for sign, meaning in _TROUBLES if sign in said)
        last = next((line.strip() for line in reversed(said.splitlines()) if line.strip()), "")
        raise FailedError(next(known, f"{command[0]} failed: {last[-300:]}"), _HINT)


def _heard(unit: str, awaited: str, since: float, patience: float) -> bool:
    end = time.monotonic() + patience
    while awaited not in systemd.journal(unit, since):
        if time.monotonic() >= end:
            return False
        time.sleep(_LOOK_EVERY)
    return True
