"""What the relay reports on /diagnostics: the peers, which nodes publish each topic, and late commands."""

from __future__ import annotations

import time
from typing import Any, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from swarm_onboard.domain_relay.config import Config
from swarm_onboard.domain_relay.delays import Delays
from swarm_onboard.domain_relay.domains import DIAGNOSTICS
from swarm_onboard.domain_relay.peer_state import PeerState

_MOST_NAMED = 3  # peers in the message
_MOST_REFUSED = 10  # lines


class Report:
    """Publishes the state of the relay."""

    def __init__(self, config: Config, node: Any) -> None:
        self._island, self._node = config.island, node
        self._publisher = node.create_publisher(DiagnosticArray, DIAGNOSTICS, 1)

    def publish(self, peers: Sequence[PeerState], delays: Sequence[tuple[str, Delays]]) -> str:
        """Publishes it, with the delays of topics. Returns the message of the status."""
        late = {topic: text for topic, one in delays if (text := one.text(time.monotonic()))}
        lost = [one for one in peers if one.problem]
        unfit = [f"{topic}: {why}" for one in peers for topic, why in one.unfit.items()]
        refused = [line for one in peers for line in one.refused]
        message = f"{len(peers) - len(lost)} of {len(peers)} peers connected"
        message += "".join(f"; {one.island}: {one.problem}" for one in lost[:_MOST_NAMED])
        message += "".join(f"; {line}" for line in unfit)
        if refused:
            message += f"; refused {refused[0]}"
            message += f", and {len(refused) - 1} more" if len(refused) > 1 else ""
        dropped = [topic for topic, one in delays if one.dropped(time.monotonic())]
        message += "".join(f"; late commands of {topic}: {late[topic]}" for topic in dropped[:_MOST_NAMED])
        warns = DiagnosticStatus.WARN if lost or refused or dropped else DiagnosticStatus.OK
        values = [
            KeyValue(key=f"{one.island} {topic}", value=", ".join(senders) or "nobody publishes it")
            for one in peers
            for topic, senders in one.senders.items()
        ]
        values += [KeyValue(key=f"{topic} within a minute", value=text) for topic, text in late.items()]
        values += [KeyValue(key="refused", value=line) for line in refused[:_MOST_REFUSED]]
        status = DiagnosticStatus(
            level=DiagnosticStatus.ERROR if unfit else warns,
            name=f"{self._island}: multimaster",
            message=message,
            hardware_id="multimaster",
            values=values,
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)
        return message
