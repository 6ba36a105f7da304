"""The program ``ssh`` with one connection: started, watched until it is logged in, and always reaped."""

from __future__ import annotations

import os
import selectors
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import count
from pathlib import Path

from swarmctl.remote.openssh_log import LoginLog, Stage

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


_CHUNK = 1 << 14
_LONGEST_LINE = 1 << 12
_LOOK = 0.05  # s between two looks whether the process has ended
_LAST_WORDS = 1.0  # s for what an ended process has written


class SshProcess:
    """One ``ssh`` in a process group of its own: Ctrl-C on the terminal does not end it, swarmctl does.

    A thread reads its log for as long as it lives: a full pipe would hold it up.
    """

    def __init__(self, argv: Sequence[str], log: Path, env: Mapping[str, str]) -> None:
        """``log``: the pipe that ``argv`` has as ``-E``; it is made here."""
        self.log = LoginLog()
        self.printed = ""
        self._path = log
        self._changed = threading.Condition()
        os.mkfifo(log, 0o600)
        self._pipe = os.open(log, os.O_RDONLY | os.O_NONBLOCK)
        try:
            self._process = subprocess.Popen(
                argv,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env=env,
                start_new_session=True,
            )
        except BaseException:
            os.close(self._pipe)
            raise
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """False once it has ended."""
        with self._changed:
            return self._process.poll() is None

    def await_login(
        self, limits: Mapping[Stage, float], *, on_touch: Callable[[], None]
    ) -> tuple[bool, float]:
        """Waits until it is logged in, or has ended, or one stage has taken longer than its limit.

        Returns whether a limit ended the wait, and the s that the last stage took. Only ``log`` shows whether
        it is logged in.
        """
        stage, since = self.log.stage, time.monotonic()
        while True:
            with self._changed:
                if self.log.stage is Stage.DONE:
                    return False, time.monotonic() - since
                if self._process.poll() is None:
                    self._changed.wait(_LOOK)
            now = time.monotonic()
            if self.log.stage is not stage:
                stage, since = self.log.stage, now
                if stage is Stage.TOUCH:
                    on_touch()
            if self._process.poll() is not None:
                self._finish_reading()
                return False, now - since
            if now - since >= limits.get(stage, limits[Stage.LOGIN]):
                return True, now - since

    def kill(self) -> None:
        """Kills it, and what it has started. From any thread."""
        with self._changed:
            if self._process.poll() is None:
                with suppress(ProcessLookupError):
                    os.killpg(self._process.pid, signal.SIGKILL)

    def close(self) -> None:
        """Kills and reaps it."""
        self.kill()
        self._process.wait()
        self._finish_reading()

    def _finish_reading(self) -> None:
        """Ends the thread once it has read everything, also where nothing was ever written to the log."""
        with suppress(OSError):
            os.close(os.open(self._path, os.O_WRONLY | os.O_NONBLOCK))
        self._reader.join(_LAST_WORDS)

    def _read(self) -> None:
        assert self._process.stderr is not None
        stderr = self._process.stderr
        os.set_blocking(stderr.fileno(), False)
        with selectors.DefaultSelector() as ready, stderr:
            ready.register(self._pipe, selectors.EVENT_READ, self._log_line)
            ready.register(stderr, selectors.EVENT_READ, self._printed_line)
            rest: dict[int, bytes] = {self._pipe: b"", stderr.fileno(): b""}
            last = False
            while not last:  # a child of a proxy command may hold stderr open: the end of the log counts
                last = self._pipe not in rest
                for key, _event in ready.select(0 if last else None):
                    try:
                        piece = os.read(key.fd, _CHUNK)
                    except BlockingIOError:  # a pipe may be reported ready, and have nothing
                        continue
                    *lines, rest[key.fd] = (rest[key.fd] + piece).split(b"\n")
                    rest[key.fd] = rest[key.fd][-_LONGEST_LINE:]
                    if not piece:
                        lines.append(rest.pop(key.fd))
                        ready.unregister(key.fileobj)
                    with self._changed:
                        for line in lines:
                            key.data(line.decode("utf-8", "replace").strip())
                        self._changed.notify_all()
        os.close(self._pipe)

    def _log_line(self, line: str) -> None:
        self.log.add(line)

    def _printed_line(self, line: str) -> None:
        self.printed = line or self.printed
