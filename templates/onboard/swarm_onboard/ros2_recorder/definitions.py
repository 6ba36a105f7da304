"""Definitions of message types as MCAP files have them (``ros2msg`` of mcap.dev/spec). Knows no rclpy."""

from __future__ import annotations

import re
from typing import Iterator

from swarm_onboard.ros2.board_types import share

_BETWEEN = "\n" + "=" * 80 + "\nMSG: "
_FIELD = re.compile(r"\s*(?P<type>[A-Za-z][A-Za-z0-9_/]*)(<=\d+)?(\[[^]]*\])?\s+[A-Za-z]", re.ASCII)


def definition(kind: str) -> str:
    """Returns the definition of ``nav_msgs/msg/Odometry`` and those that it uses; empty if one is missing."""
    texts: dict[str, str] = {}
    due = [kind.replace("/msg/", "/")]
    try:
        while due:
            name = due.pop()
            if name not in texts:
                package, _, short = name.partition("/")
                texts[name] = share(package).joinpath("msg", f"{short}.msg").read_text("utf-8")
                due += _used(texts[name], package)
    except (OSError, UnicodeDecodeError):  # such as a package whose messages are defined in IDL
        return ""
    (_, first), *others = texts.items()
    return first + "".join(f"{_BETWEEN}{name}\n{text}" for name, text in others)


def _used(text: str, package: str) -> Iterator[str]:
    """The types of the fields that are messages themselves."""
    for line in text.splitlines():
        found = _FIELD.match(line)
        if found and "/" in found["type"]:
            yield found["type"].replace("/msg/", "/")
        elif found and found["type"][0].isupper():
            yield f"{package}/{found['type']}"
