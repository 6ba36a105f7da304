"""MCAP files with the messages of a recording, one after the other. Knows no rclpy."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Callable, Iterator

from mcap.writer import CompressionType, Writer

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


_CHUNK = 256 << 10  # bytes of messages between two indexes


class BagFiles:
    """Writes ``PREFIX_0.mcap``, and another once it has ``size`` bytes; names end with ``.active`` till then.

    ``definition`` returns that of a type, empty if it is unknown. What writes raises ``OSError``.
    """

    def __init__(self, prefix: str, size: int, definition: Callable[[str], str]) -> None:
        self._prefix, self._size, self._definition = prefix, size, definition
        self._number = -1
        self._begin()

    def add(self, topic: str, kind: str, message: bytes, arrived: int, sent: int) -> None:
        """Adds a serialised message; both times in ns since 1970."""
        if os.fstat(self._file.fileno()).st_size >= self._size:
            self.close()
            self._begin()
        channel = self._channels.get((topic, kind)) or self._channel(topic, kind)
        self._writer.add_message(channel, arrived, message, sent)

    def flush(self) -> None:
        """Writes what was added, and lets the kernel bring it to the disk now, rather than after 30 s."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        os.posix_fadvise(self._file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)

    def close(self) -> None:
        """Ends the file, with the index that readers need."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()
        self._draft.rename(self._draft.with_suffix(""))

    def _begin(self) -> None:
        self._number += 1
        self._draft = Path(f"{self._prefix}_{self._number}.mcap.active")
        self._file = self._draft.open("xb")
        # A host has no library that compresses.
        self._writer = Writer(self._file, chunk_size=_CHUNK, compression=CompressionType.NONE)
        self._writer.start("ros2")
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}

    def _channel(self, topic: str, kind: str) -> int:
        if kind not in self._schemas:
            text = self._definition(kind)
            encoding = "ros2msg" if text else ""
            self._schemas[kind] = self._writer.register_schema(kind, encoding, text.encode("utf-8"))
        found = self._writer.register_channel(topic, "cdr", self._schemas[kind])
        self._channels[topic, kind] = found
        return found
