"""What the relay reports on /diagnostics: the peers, and which nodes publish each topic."""

from __future__ import annotations

from typing import Any, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from swarm_onboard.domain_relay.config import Config
from swarm_onboard.domain_relay.domains import DIAGNOSTICS, Away

_MOST_NAMED = 3  # peers in the message


class Report:
    """Publishes the state of the relay."""

    def __init__(self, config: Config, node: Any) -> None:
        self._island, self._node = config.island, node
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS, 1)

    def publish(self, peers: Sequence[Away]) -> str:
        """Publishes it. Returns the message of the status."""
        lost = [one.island for one in peers if not one.nodes][:_MOST_NAMED]
        missing = {topic: kind for one in peers for topic, kind in one.missing.items()}
        message = f"{len(peers) - len(lost)} of {len(peers)} peers connected"
        message += "".join(f"; {name}: no node is seen" for name in lost)
        message += "".join(f"; {topic}: this host lacks {kind}" for topic, kind in missing.items())
        level = DiagnosticStatus.ERROR if missing else DiagnosticStatus.WARN if lost else DiagnosticStatus.OK
        values = [
            KeyValue(key=f"{one.island} {topic}", value=", ".join(senders) or "nobody publishes it")
            for one in peers
            for topic, senders in one.senders().items()
        ]
        status = DiagnosticStatus(
            level=level,
            name=f"{self._island}: multimaster",
            message=message,
            hardware_id="multimaster",
            values=values,
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)
        return message
