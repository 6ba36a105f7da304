"""Forwards the reports of a node to systemd, and to ROS once the node is connected. Knows no ROS."""

from __future__ import annotations

from typing import Protocol

from swarm_onboard.command.report import Report
from swarm_onboard.common.systemd import Notifier


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
        self._notifier.status(report.message)
        if self.ros:
            self.ros.report(report)

    def leave(self) -> None:
        """Unregisters the node, if it is connected."""
        if self.ros:
            self.ros.leave()
