"""Message types of ROS 1 for the topics of a board: their bytes pass unchanged."""

from __future__ import annotations

import io
import re
from functools import lru_cache
from typing import Any

_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*", re.ASCII)


def md5sum_and_least(name: str) -> tuple[str, int] | None:
    """Returns the MD5 sum of a type and the size of its smallest message; None if no package has it."""
    message = message_class(name)
    if message is None:
        return None
    smallest = io.BytesIO()
    message().serialize(smallest)
    return message._md5sum, len(smallest.getvalue())


@lru_cache(maxsize=64)
def message_class(name: str) -> Any:
    """Returns the class of a message type in the packages of this host; None if there is none."""
    if not _TYPE.fullmatch(name):
        return None
    from roslib.message import get_message_class  # noqa: PLC0415  not every driver needs it

    try:
        return get_message_class(name)
    except Exception:  # noqa: BLE001  whatever is wrong with a package, it has no such type for us
        return None


def raw_class(name: str) -> Any:
    """Returns a class for the bytes of the type ``name``, which other nodes cannot distinguish from it."""
    import rospy  # noqa: PLC0415  importing ROS takes longer than stopping the robot

    message = message_class(name)
    return type(
        message.__name__,
        (rospy.AnyMsg,),
        {"_type": message._type, "_md5sum": message._md5sum, "_full_text": message._full_text},
    )
