"""A message type that is not installed. A topic of ROS 1 does without its definition; one of ROS 2 cannot."""

from __future__ import annotations

from typing import Any

AnyMsg: Any
try:
    from rospy import AnyMsg
except ImportError:  # ROS 2
    AnyMsg = None


def untyped(kind: str) -> Any:
    """Returns a message class of that name without content; None in ROS 2.

    Its MD5 sum is the wildcard of rospy, so nodes that only count or look up the topic see it; no node with
    the real type connects.
    """
    if AnyMsg is None:
        return None
    empty = {"_type": kind, "_md5sum": AnyMsg._md5sum, "__init__": _without_content}
    return type(kind.rpartition("/")[2], (AnyMsg,), empty)


def _without_content(message: Any) -> None:
    AnyMsg.__init__(message)
    message._buff = b""
