"""A node's diagnostics: a level, a message and values, as in REP-107."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Mapping, Protocol, Sequence

from swarm_onboard.common.systemd import Notifier


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


class RosNode(Protocol):
    """The node's connection with ROS."""

    def report(self, report: Report) -> None:
        """Publishes the state of the node on /diagnostics."""

    def leave(self) -> None:
        """Unregisters the node."""


class Reporter:
    """``ros`` is None until the node is connected: nothing is published before."""

    def __init__(self, notifier: Notifier) -> None:
        self.ros: RosNode | None = None
        self._notifier = notifier

    def report(self, report: Report) -> None:
        """Takes the state of the node."""
        self._notifier.status(report.message, error=report.level >= Level.ERROR)
        if self.ros:
            self.ros.report(report)

    def leave(self) -> None:
        """Unregisters the node, if it is connected."""
        if self.ros:
            self.ros.leave()
