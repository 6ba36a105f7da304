"""A node's diagnostics: a level, a message and values, as in REP-107."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Mapping, Sequence


class Level(IntEnum):
    """As in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Report:
    """One message on /diagnostics."""

    level: Level
    message: str
    values: Mapping[str, str]

    def without(self, left_out: Sequence[str], *, least: Level = Level.OK) -> Report:
        """Returns the report with what this host cannot publish, at level ``least`` or worse."""
        if not left_out:
            return self
        values = {**self.values, "left out": "; ".join(left_out)}
        return Report(max(self.level, least), "; ".join([self.message, *left_out]), values)
