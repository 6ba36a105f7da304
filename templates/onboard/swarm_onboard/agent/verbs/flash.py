"""``flash``: write a firmware to a robot's board while its driver is stopped; wait for the board to start."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import time

from swarm_onboard.agent import lease, lock, motion_gate, systemd, unit_start
from swarm_onboard.agent.errors import FailedError, RefusedError
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import Home, home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, BinaryIO, Sequence

_FOLDER = "/firmware"  # in the swarm's state, while a board is written
_WRITING = 120  # s
_LOOK_EVERY = 0.5
_WATCH_EVERY = 0.1
_CHECK = "is it the right board, speed (--speed) and cable? its reset button helps one that hangs"
_AGAIN = "it stands still until it is flashed again"
# avrdude's output, its meaning for the person at the robot, and what to do.
_TROUBLES = (
    ("programmer is not responding", "the board's boot loader does not answer on {}", _CHECK),
    ("not in sync", "the board's boot loader does not answer on {}", _CHECK),
    (
        "verification",
        "what the board holds now is not what was written to it",
        _AGAIN + "; if that fails each time, its flash is worn out",
    ),
    ("Device signature", "the board on {} has another processor", _CHECK),
    ("ermission denied", "{} cannot be opened: permission denied", _CHECK),
    ("esource busy", "{} is in use by another program", _CHECK),
)


class Request(NamedTuple):
    """Write a firmware to a robot's board while its driver ``unit`` is stopped, and wait for the board.

    ``files``: name and size of each, in the payload's order; ``write``: avrdude's command, run in their
    folder; ``digest``: of the firmware; ``patience``: s to wait until the driver logs that digest.
    """

    swarm: str
    unit: str
    port: str
    files: list[list[Any]]
    write: list[str]
    digest: str
    patience: float
    who: str = ""
    wait: float = 2.0
    run: str = ""
    stop_robots: bool = False


class Answer(NamedTuple):
    """``runs``: the driver ran before and runs again; ``logged``: it logged this firmware of the board."""

    runs: bool
    logged: bool


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Writes a firmware to a board while its driver is stopped.

    Raises ``RefusedError`` and ``FailedError``.
    """
    home = home_of(request.swarm)
    port, unit = str(request.port), str(request.unit)
    command = [str(word) for word in request.write]
    if shutil.which(command[0]) is None:
        raise RefusedError(f"{command[0]} is missing", f"sudo apt install {command[0]}")
    if not os.path.exists(home.outside(port)):
        raise RefusedError(f"there is no {port}", "is the board's cable in, and was the swarm deployed?")
    with lease.held_for(home, request):
        who = lock.operator_in(request)
        motion_gate.clear(home, [unit], stop=bool(request.stop_robots), who=who, note=report.note)
        report.detach()
        runs = systemd.running([unit])
        troubles = []
        try:
            if runs:
                report.note(f"stop {unit}")
                systemd.stop(runs)
            report.note(f"write {port}")
            _write(home, request.files, payload, command, port)
        except FailedError as error:
            troubles.append(error)
        began = time.time()
        try:
            if runs:
                report.note(f"start {unit}")
                unit_start.start(runs)
        except FailedError as error:
            troubles.append(error)
    if troubles:
        raise FailedError("; ".join(one.message for one in troubles), troubles[0].hint)
    if not runs:
        return Answer(False, False)
    report.note("wait for the board to name its firmware")
    awaited = "swarmctl firmware " + str(request.digest)
    return Answer(True, _logged(unit, awaited, began, min(float(request.patience), 120)))


def _write(home: Home, files: Sequence[Any], payload: bytes, command: Sequence[str], port: str) -> None:
    folder = home.state + _FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    try:
        os.mkdir(folder, 0o700)
        for name, size in files:
            with open(os.path.join(folder, os.path.basename(name)), "wb") as file:
                file.write(payload[:size])
            payload = payload[size:]
        with tempfile.TemporaryFile() as output:
            _run(command, folder, port, home.outside(port), output)
    except OSError as error:
        raise FailedError(f"the board was not written: {error}", "look at the host's disk") from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _run(command: Sequence[str], folder: str, port: str, device: str, output: BinaryIO) -> None:
    process = subprocess.Popen(
        command, cwd=folder, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
    )
    began, end = os.stat(device), time.monotonic() + _WRITING
    while process.poll() is None and _same(device, began) and time.monotonic() < end:
        time.sleep(_WATCH_EVERY)
    stopped = process.poll() is None
    process.kill()  # avrdude 7.1 reads for ever from a port that is gone
    process.wait()
    if not _same(device, began):
        raise FailedError(f"{port} vanished while the board was written", f"is its cable in? {_AGAIN}")
    if stopped:
        raise FailedError(f"{command[0]} did not end within {_WRITING} s", _CHECK)
    if process.returncode != 0:
        output.seek(0)
        raise _trouble(output.read().decode("utf-8", "replace"), command[0], port)


def _same(device: str, began: os.stat_result) -> bool:
    try:
        return os.path.samestat(os.stat(device), began)
    except OSError:
        return False


def _trouble(output: str, program: str, port: str) -> FailedError:
    for sign, meaning, hint in _TROUBLES:
        if sign in output:
            return FailedError(meaning.format(port), hint)
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    complaints = [line for line in lines if "error" in line and "ioctl" not in line] or lines or [""]
    return FailedError(f"{program} failed: {complaints[-1][-300:]}", _CHECK)


def _logged(unit: str, awaited: str, since: float, patience: float) -> bool:
    end = time.monotonic() + patience
    while awaited not in systemd.journal(unit, since):
        if time.monotonic() >= end:
            return False
        time.sleep(_LOOK_EVERY)
    return True
