"""What the journal has of units: the restarts by systemd itself, how main processes ended, messages."""

from __future__ import annotations

import signal

from swarm_onboard.common.systemd import REJOINS

from . import json_text, systemd
from .named_tuple import NamedTuple

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterator, Sequence

# systemd/sd-messages.h
_RESTARTED = "5eb03494b6584870a536b337290809b3"  # SD_MESSAGE_UNIT_RESTART_SCHEDULED
_EXITED = "98e322203f7a4ed290d09fe03c09fe15"  # SD_MESSAGE_UNIT_PROCESS_EXIT
_REJOINED = f"exit code {REJOINS}"
_MOST_EVENTS = 3000
_MOST_MESSAGES = 2000
_TIMEOUT = 10  # s


class Restarts(NamedTuple):
    """When systemd restarted a unit (s since 1970), and how its main process ended last, empty if unknown.

    ``rejoined``: other restarts, since its last start by hand or by a deploy, that followed a new ROS master.
    """

    times: list[float]
    exit: str
    rejoined: int


class Message(NamedTuple):
    """A line of a unit's log: its time (s since 1970), its text."""

    time: float
    text: str


def restarts(units: Sequence[str], since: float) -> dict[str, Restarts]:
    """The restarts of each unit since ``since`` (s since 1970). A start by hand or by a deploy is none."""
    matches = [f"MESSAGE_ID={_RESTARTED}", f"MESSAGE_ID={_EXITED}", *(f"UNIT={unit}" for unit in units)]
    fields = "MESSAGE,MESSAGE_ID,UNIT,EXIT_CODE,EXIT_STATUS,N_RESTARTS"
    found = {unit: Restarts([], "", 0) for unit in units}
    for entry in _entries(fields, 0.0, _MOST_EVENTS, matches):
        unit = str(entry.get("UNIT"))
        if unit not in found:
            continue
        if entry.get("MESSAGE_ID") == _RESTARTED:
            before = 0 if entry.get("N_RESTARTS") == "1" else found[unit].rejoined
            rejoins = found[unit].exit == _REJOINED
            found[unit] = found[unit]._replace(rejoined=before + rejoins)
            if not rejoins and _time(entry) >= since:
                found[unit].times.append(_time(entry))
        elif entry.get("MESSAGE_ID") == _EXITED and "ain process" in _text(
            entry
        ):  # "Main process exited"; not a control process
            found[unit] = found[unit]._replace(exit=_exit(entry))
    return found


def messages(unit: str, since: float, pid: int = 0) -> list[Message]:
    """The latest log lines of a unit since ``since``, oldest first. ``pid``: of this process alone."""
    matches = [f"_SYSTEMD_UNIT={unit}", *([f"_PID={pid}"] if pid else [])]
    return [Message(_time(one), _text(one)) for one in _entries("MESSAGE", since, _MOST_MESSAGES, matches)]


def units_with(texts: Sequence[str], since: float) -> set[str]:
    """The units that have logged one of ``texts`` since ``since``; the journal has an index of messages."""
    if not texts:
        return set()
    matches = [f"MESSAGE={text}" for text in texts]
    found = _entries("_SYSTEMD_UNIT", since, _MOST_MESSAGES, matches)
    return {str(one.get("_SYSTEMD_UNIT")) for one in found}


def _entries(fields: str, since: float, most: int, matches: Sequence[str]) -> Iterator[dict[str, Any]]:
    command = ["journalctl", f"--since=@{since:.6f}", f"--lines={most}", "--output=json", "--no-pager"]
    output = systemd.call([*command, "--boot", f"--output-fields={fields}", *matches], _TIMEOUT)
    for line in output.splitlines():
        try:
            entry = json_text.loads(line)
        except ValueError:  # cut off, or a remark of journalctl
            continue
        if isinstance(entry, dict):
            yield entry


def _time(entry: dict[str, Any]) -> float:
    stamp = str(entry.get("__REALTIME_TIMESTAMP"))
    return int(stamp) / 1e6 if stamp.isdigit() else 0.0


def _text(entry: dict[str, Any]) -> str:
    """The message; one with colours is a list of bytes."""
    message = entry.get("MESSAGE")
    if isinstance(message, list):
        return bytes(one for one in message if isinstance(one, int) and 0 <= one < 256).decode(
            "utf-8", "replace"
        )
    return str(message or "")


def _exit(entry: dict[str, Any]) -> str:
    """How a process ended, such as ``exit code 1`` or ``SIGKILL``."""
    status = str(entry.get("EXIT_STATUS"))
    if not status.isdigit():
        return ""
    if entry.get("EXIT_CODE") == "exited":
        return f"exit code {status}"
    try:
        return signal.Signals(int(status)).name
    except ValueError:
        return f"signal {status}"
