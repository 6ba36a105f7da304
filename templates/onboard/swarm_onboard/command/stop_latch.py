"""The latch of ``swarmctl stop``: while its file exists, a robot stands, whatever it is commanded.

A datagram on the socket ``motion`` in the unit's RuntimeDirectory wakes the loop, which looks for the file
and answers with the robot's motion. Only root and the unit's own account can send one.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
from pathlib import Path
from typing import Any, Callable, Mapping

from swarm_onboard.command.command_mailbox import CommandMailbox

SOCKET = "motion"
_LONGEST = 256  # bytes of a datagram


class StopLatch:
    """Holds and releases ``commands`` as the file ``path`` comes and goes; without a path it never does."""

    def __init__(self, path: str, commands: CommandMailbox, folder: str | None = None) -> None:
        self._file = Path(path) if path else None
        self._commands = commands
        folder = os.environ.get("RUNTIME_DIRECTORY", "") if folder is None else folder
        self._socket = _bound(Path(folder, SOCKET)) if folder else None

    def look(self) -> None:
        """Takes over whether the file exists now."""
        if self._file is not None:
            self._commands.hold(held=_exists(self._file))

    def listens_to(self) -> list[socket.socket]:
        """Returns the socket whose input calls for a look and an answer, if there is one."""
        return [self._socket] if self._socket is not None else []

    def answer(
        self, motion: Callable[[], Mapping[str, Any]], requested: Callable[[str], None] = lambda _: None
    ) -> None:
        """Sends ``motion`` as JSON to the sender of each question since the last call.

        ``requested`` takes the text of each one first.
        """
        if self._socket is None:
            return
        with contextlib.suppress(OSError):  # there is no question, or its sender has gone
            while True:
                question, sender = self._socket.recvfrom(_LONGEST)
                if sender:
                    words = question.decode("ascii", "replace")
                    requested(words)
                    text = json.dumps({**motion(), "question": words})
                    self._socket.sendto(text.encode("utf-8"), sender)


def _exists(path: Path) -> bool:
    """Returns False only if the file is surely not there."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:
        pass
    return True


def _bound(path: Path) -> socket.socket | None:
    """A socket at ``path``; None if it cannot be made: the loop looks for the file without being woken."""
    with contextlib.suppress(OSError):
        with contextlib.suppress(FileNotFoundError):
            path.unlink()
        made = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        made.setblocking(False)
        made.bind(str(path))
        return made
    return None
