"""Log entries of journald: read, rated by level, merged over hosts in the order of time. Pure."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

LEVELS = ("debug", "info", "warn", "error", "fatal")
_OF_PRIORITY = ("fatal", "fatal", "fatal", "error", "warn", "info", "info", "debug")  # syslog(3)
_OF_ROS = re.compile(r"\[ *(DEBUG|INFO|WARN|ERROR|FATAL)(?:ING)? *\]")
_ROS_WITHIN = 40  # characters in which rospy and rclpy print the level
_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_FORMATS = ("%Y-%m-%d %H:%M:%S", "%Y-%m-%d %H:%M", "%Y-%m-%d")


@dataclass(frozen=True)
class Entry:
    """One message; ``time`` is in s since 1970 by the operator's clock."""

    time: float
    host: str
    source: str
    level: str
    message: str


def parse(line: bytes, host: str, swarm: str, offset: float) -> Entry | None:
    """The entry in a line of ``journalctl -o json``; None for anything else.

    Args:
        line: the line, without its end.
        host: the name of the host.
        swarm: the name of the swarm.
        offset: how far the host's clock is ahead of the operator's, in s.
    """
    try:
        fields: Any = json.loads(line)
        time = int(fields["__REALTIME_TIMESTAMP"]) / 1e6 - offset
        unit, message = str(fields.get("UNIT") or fields["_SYSTEMD_UNIT"]), _text(fields["MESSAGE"])
        level = _OF_PRIORITY[int(fields.get("PRIORITY", 6)) & 7]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    if named := _OF_ROS.search(message[:_ROS_WITHIN]):
        level = named[1].lower()
    source = unit.removeprefix(f"swarm-{swarm}.").removesuffix(".service").replace(".", "/")
    return Entry(time, host, source, level, message)


def _text(value: Any) -> str:
    if value is None:
        return "(too long for the journal's JSON)"
    return bytes(value).decode("utf-8", "backslashreplace") if isinstance(value, list) else str(value)


def merged(hosts: Iterable[Sequence[Entry]], level: str, pattern: re.Pattern[str] | None) -> list[Entry]:
    """The entries of all hosts, those of ``level`` or worse that match, in the order of time."""
    lowest = LEVELS.index(level)
    found = [
        entry
        for entries in hosts
        for entry in entries
        if LEVELS.index(entry.level) >= lowest and (pattern is None or pattern.search(entry.message))
    ]
    return sorted(found, key=lambda entry: entry.time)


def since(text: str, now: datetime) -> float:
    """The time that ``10m``, ``21:00`` or ``2026-11-26 21:00`` means, in s since 1970; or ``ValueError``."""
    if ago := re.fullmatch(r"(\d{1,6})([smhd])", text):
        return (now - timedelta(seconds=int(ago[1]) * _UNITS[ago[2]])).timestamp()
    readings = (_time(full, form) for form in _FORMATS for full in (text, f"{now:%Y-%m-%d} {text}"))
    found = next((reading for reading in readings if reading is not None), None)
    if found is None:
        raise ValueError(text)
    return found


def _time(text: str, form: str) -> float | None:
    try:
        return datetime.strptime(text, form).astimezone().timestamp()
    except ValueError:
        return None
