"""A topic that a board announces, and whether the host can serve it. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

from swarm_onboard.rosserial.frames import FIRST_TOPIC_ID, ID_PUBLISHER, OVERHEAD
from swarm_onboard.rosserial.messages import TopicInfo


@dataclass(frozen=True)
class MessageType:
    """A message type as installed on the host. ``least`` is the size of its smallest message, bytes."""

    md5sum: str
    least: int


#: The message type of that name; None if no package on the host has it.
Types = Callable[[str], Optional[MessageType]]


@dataclass(frozen=True)
class Topic:
    """A topic of a board. ``capacity``: the largest message that its buffer holds, bytes."""

    id: int
    name: str
    type: str
    md5sum: str
    capacity: int
    published: bool  # by the board


@dataclass(frozen=True)
class Refusal:
    """A topic that the host does not serve, and why."""

    name: str
    reason: str


def judge(endpoint: int, info: TopicInfo, types: Types) -> Topic | Refusal:
    """Returns the topic that ``info`` announces, or why the host cannot serve it."""
    published = endpoint == ID_PUBLISHER
    # A board builds the frame that it sends in its buffer; of one that it receives only the message is kept.
    capacity = info.buffer_size - OVERHEAD if published else info.buffer_size
    reason = _reason_against(info, capacity, types, "publishes" if published else "subscribes to")
    if reason:
        return Refusal(info.topic_name, reason)
    return Topic(info.topic_id, info.topic_name, info.message_type, info.md5sum, capacity, published)


def _reason_against(info: TopicInfo, capacity: int, types: Types, verb: str) -> str:
    claim = f"the sketch {verb} `{info.topic_name}` as {info.message_type}"
    if info.topic_id < FIRST_TOPIC_ID:
        return f"{claim} under the id {info.topic_id}, which the protocol reserves"
    if info.topic_name.startswith(("/", "~")):
        return (
            f"{claim}, which is not within the robot's namespace: "
            f"write the name without `{info.topic_name[0]}`"
        )
    known = types(info.message_type)
    if known is None:
        return f"{claim}, which no package on this host has: install {info.message_type.split('/')[0]}"
    if known.md5sum != info.md5sum:
        return (
            f"{claim} of another definition ({info.md5sum}) than this host's ({known.md5sum}): "
            "build the sketch with this host's message headers"
        )
    if known.least > capacity:
        return (
            f"{claim}, {known.least} bytes at least, but its buffer holds {max(0, capacity)}: "
            "give its NodeHandle larger buffers"
        )
    return ""


def unserved_service(info: TopicInfo) -> Refusal:
    """Returns the refusal of a service."""
    reason = (
        f"the sketch has a service, `{info.topic_name}`: this driver forwards topics only "
        "(`driver: rosserial_python` serves it)"
    )
    return Refusal(info.topic_name, reason)
