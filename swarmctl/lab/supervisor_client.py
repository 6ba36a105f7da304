"""What the commands of a lab ask its supervisor."""

from __future__ import annotations

from typing import Any

from swarmctl.lab import control_socket
from swarmctl.lab.errors import LabError
from swarmctl.lab.lab_state import read_state
from swarmctl.lab.paths import LabPaths


def status(files: LabPaths) -> dict[str, Any] | None:
    """Returns the supervisor's report on hosts and robots; None if it does not run."""
    try:
        return control_socket.send(files.socket, {"do": "status"})
    except OSError:
        return None


def running(files: LabPaths) -> dict[str, Any]:
    """Returns the report of a running lab. Raises ``LabError`` if it is not up or not running."""
    read_state(files)
    report = status(files)
    if report is None:
        raise _not_running(files)
    return report


def command(files: LabPaths, verb: str, subject: str) -> None:
    """Sends ``verb`` for a host or a robot. Raises ``LabError`` if it fails or the lab is not running."""
    try:
        control_socket.send(files.socket, {"do": verb, "what": subject})
    except OSError:
        raise _not_running(files) from None


def _not_running(files: LabPaths) -> LabError:
    return LabError(
        f"lab {files.name} is not running",
        "run `swarmctl lab up` to start it again, `lab down` to remove it",
    )
