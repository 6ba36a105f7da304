"""Lines for each log entry, coloured by its source."""

from __future__ import annotations

import zlib
from datetime import datetime, timezone

from rich.text import Text

from swarmctl.health.host_logs import Entry
from swarmctl.views.escape import printable

_COLOURS = ("cyan", "green", "magenta", "blue", "bright_cyan", "bright_green", "bright_magenta")
_OF_LEVEL = {"warn": "yellow", "error": "red", "fatal": "bold red"}


def lines(entry: Entry) -> Text:
    """Such as ``21:00:03.120 k3  warn   battery low``, with further lines of the message below."""
    moment = datetime.fromtimestamp(entry.time, timezone.utc).astimezone()
    return _lines(entry, moment.strftime("%H:%M:%S.%f")[:-3])


def dated(entry: Entry, ahead: float) -> str:
    """The same with the date, such as ``2026-11-30T20:00:03.120Z k3  warn   battery low``.

    It is in UTC, by a clock that is ``ahead`` of the operator's, in s, and has no time if that shows none.
    """
    try:
        moment = datetime.fromtimestamp(entry.time + ahead, timezone.utc)
    except (ValueError, OverflowError, OSError):
        return _lines(entry, "-").plain
    return _lines(entry, f"{moment:%Y-%m-%dT%H:%M:%S.%f}"[:-3] + "Z").plain


def _lines(entry: Entry, when: str) -> Text:
    robot = entry.source.partition("/")[0]
    first, *rest = (printable(one) for one in entry.message.split("\n"))
    return Text.assemble(
        f"{when} ",
        (printable(entry.source), _COLOURS[zlib.crc32(robot.encode()) % len(_COLOURS)]),
        "  ",
        (f"{entry.level:5}", _OF_LEVEL.get(entry.level, "")),
        f"  {first}",
        *(f"\n    {one}" for one in rest),
    )
