"""A private folder for the files of logins; whatever ends swarmctl, it and its connections go with it."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import weakref
from contextlib import suppress
from itertools import count
from pathlib import Path

_END = 10.0  # s in which the watchdog should end
# It waits until swarmctl is gone. A login under way then finds no place for its control socket, and ends.
_WATCHDOG = (
    'read -r _; for one in "$1"/*/ctl; do [ -S "$one" ] && '
    '"$2" -F none -S "$one" -O exit x; done; rm -rf "$1"'
)


class LoginFolders:
    """Makes a folder for each login. Safe between threads."""

    def __init__(self, program: str) -> None:
        """``program``: where ``ssh`` is."""
        self._numbers = count()
        self._root = Path(tempfile.mkdtemp(prefix="swarmctl-"))  # for this account alone
        watchdog = subprocess.Popen(
            ["/bin/sh", "-c", _WATCHDOG, "sh", str(self._root), program],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._end = weakref.finalize(self, _release, watchdog)

    def new(self) -> Path:
        """Returns a new folder."""
        folder = self._root / str(next(self._numbers))
        folder.mkdir(mode=0o700)
        return folder

    def remove(self, folder: Path) -> None:
        """Removes a folder that ``new`` made."""
        shutil.rmtree(folder, ignore_errors=True)


def _release(watchdog: subprocess.Popen[bytes]) -> None:
    assert watchdog.stdin is not None
    with suppress(OSError):
        watchdog.stdin.close()
    with suppress(subprocess.TimeoutExpired):
        watchdog.wait(_END)


def write_private(path: Path, text: str) -> None:
    """Writes a file that only this account can read."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(descriptor, "w", encoding="utf-8", errors="surrogateescape") as file:  # noqa: PTH123
        file.write(text)
