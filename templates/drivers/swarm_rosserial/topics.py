"""A topic that a board announces, and whether the host can serve it. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

from swarm_rosserial.frames import FIRST_TOPIC_ID, ID_PUBLISHER, OVERHEAD
from swarm_rosserial.messages import TopicInfo


@dataclass(frozen=True)
class MessageType:
    """What the host knows of a message type. ``least`` is the size of its smallest message, bytes."""

    md5sum: str
    least: int


#: The message type of that name; nothing if no package on the host has it.
Types = Callable[[str], Optional[MessageType]]


@dataclass(frozen=True)
class Topic:
    """A topic of a board. ``room`` is the size of the largest message that passes its buffer, bytes."""

    id: int
    name: str
    type: str
    md5sum: str
    room: int
    published: bool  # by the board


@dataclass(frozen=True)
class Refusal:
    """A topic that stays unserved, and why."""

    name: str
    reason: str


def judge(endpoint: int, info: TopicInfo, types: Types) -> Topic | Refusal:
    """The topic that ``info`` announces, if the host can serve it."""
    published = endpoint == ID_PUBLISHER
    # A board builds the frame that it sends in its buffer; of one that it receives only the message is kept.
    room = info.buffer_size - OVERHEAD if published else info.buffer_size
    reason = _hindrance(info, room, types, "publishes" if published else "hears")
    if reason:
        return Refusal(info.topic_name, reason)
    return Topic(info.topic_id, info.topic_name, info.message_type, info.md5sum, room, published)


def _hindrance(info: TopicInfo, room: int, types: Types, verb: str) -> str:
    claim = f"the sketch {verb} `{info.topic_name}` as {info.message_type}"
    if info.topic_id < FIRST_TOPIC_ID:
        return f"{claim} under the id {info.topic_id}, which is the protocol's own"
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
    if known.least > room:
        return (
            f"{claim}, {known.least} bytes at least, and its buffer has room for {max(0, room)}: "
            "give its NodeHandle larger buffers"
        )
    return ""


def unserved_service(info: TopicInfo) -> Refusal:
    reason = (
        f"the sketch has a service, `{info.topic_name}`: this driver forwards topics only "
        "(`driver: rosserial_python` serves it)"
    )
    return Refusal(info.topic_name, reason)
