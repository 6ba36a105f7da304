"""Publishes the reports of one part of a robot on /diagnostics (REP 107)."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from swarm_onboard.command.report import Report
from swarm_onboard.ros.node import Kind, Node

_LEVELS = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR)  # bytes in ROS 2


class Diagnostics:
    """``name`` and ``hardware`` as in diagnostic_msgs/DiagnosticStatus."""

    def __init__(self, node: Node, name: str, hardware: str) -> None:
        self._node, self._name, self._hardware = node, name, hardware
        self._publisher = node.publisher("/diagnostics", DiagnosticArray, Kind.STATE)

    def publish(self, report: Report) -> None:
        """Publishes ``report``."""
        status = DiagnosticStatus(
            level=_LEVELS[report.level],
            name=self._name,
            message=report.message,
            hardware_id=self._hardware,
            values=[KeyValue(key=key, value=value) for key, value in report.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self._node.now()
        self._publisher.publish(message)
