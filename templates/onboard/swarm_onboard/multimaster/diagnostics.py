"""The diagnostics of the node: one status with a few lines per peer, and its bytes as a ROS message.

The bytes are made here and not by rospy, which does not survive a restart of its master.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Mapping, Sequence

from swarm_onboard.common.tcpros import counted
from swarm_onboard.multimaster.config import Config, Peer
from swarm_onboard.multimaster.peer_state import Contact, Refusal, State, offered_by, state_of

TOPIC = "/diagnostics"
TYPE = "diagnostic_msgs/DiagnosticArray"
MD5SUM = "60810da900de1dd6ddd437c3503511da"

OK, WARN, ERROR = 0, 1, 2
_MOST_REFUSALS = 10
_MOST_NAMED = 3  # peers in the message


@dataclass(frozen=True)
class Status:
    """A diagnostic_msgs/DiagnosticStatus."""

    level: int
    name: str
    message: str
    values: tuple[tuple[str, str], ...]


def status_of(
    config: Config, contacts: Mapping[str, Contact], own_problem: str, refusals: Sequence[Refusal], now: float
) -> Status:
    """The status of the node. ``contacts`` by island, ``own_problem`` of the own master."""
    states = {peer.island: state_of(contacts[peer.island], now, config) for peer in config.peers}
    here = sum(state is State.CONNECTED for state in states.values())
    message = f"{here} of {len(states)} peers connected"
    lost = [name for name, state in states.items() if state is not State.CONNECTED][:_MOST_NAMED]
    message += "".join(f"; {name}: {contacts[name].problem or states[name].value}" for name in lost)
    if own_problem:
        message = f"own master: {own_problem}; {message}"
    if refusals:
        one = refusals[0]
        message += f"; refused {one.topic} of {one.node}: {one.why}"
        message += f", and {len(refusals) - 1} more" if len(refusals) > 1 else ""
    level = ERROR if own_problem else WARN if refusals or here < len(states) else OK
    values = [line for peer in config.peers for line in _lines(config, peer, contacts[peer.island], now)]
    values += [(f"refused {one.topic}", f"{one.node}: {one.why}") for one in refusals[:_MOST_REFUSALS]]
    return Status(level, f"{config.island}: multimaster", message, tuple(values))


def _lines(config: Config, peer: Peer, contact: Contact, now: float) -> list[tuple[str, str]]:
    state = state_of(contact, now, config)
    shown = state.value + (f": {contact.problem}" if contact.problem else "")
    last_seen = "never" if contact.last_seen is None else f"{now - contact.last_seen:.1f} s ago"
    entries = offered_by(contact, now, config)
    counts = {topic: sum(entry.topic == topic for entry in entries) for topic in peer.receives}
    lines = [
        (peer.island, shown),
        (f"{peer.island} last contact", last_seen),
        (
            f"{peer.island} topics received",
            ", ".join(f"{topic} {count}" for topic, count in counts.items()) or "nothing",
        ),
    ]
    return lines + ([(f"{peer.island} topics sent", ", ".join(peer.sends))] if peer.sends else [])


def message_of(status: Status, number: int, seconds: float) -> bytes:
    """A serialised diagnostic_msgs/DiagnosticArray with ``status``, at ``seconds`` since 1970."""
    whole = int(seconds)
    header = struct.pack("<III", number & 0xFFFFFFFF, whole, int((seconds - whole) * 1e9)) + counted(b"")
    fields = (status.name, status.message, "multimaster")
    body = bytes([status.level]) + b"".join(counted(field.encode()) for field in fields)
    pairs = b"".join(counted(key.encode()) + counted(value.encode()) for key, value in status.values)
    return header + struct.pack("<I", 1) + body + struct.pack("<I", len(status.values)) + pairs
