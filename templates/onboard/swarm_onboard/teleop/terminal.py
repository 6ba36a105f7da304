"""Single keys from a terminal, which gets back the settings that it had, whatever happens."""

from __future__ import annotations

import contextlib
import os
import select
import shutil
import termios
from types import TracebackType

_IFLAG, _LFLAG, _CC = 0, 3, 6
_DISABLED = b"\x00"
_WIDTH = 80  # where a terminal does not say


class Terminal:
    """A context in which keys come one by one, unseen. Ctrl-C and Ctrl-\\ stay signals; Ctrl-Z is a key."""

    def __init__(self, keys_from: int = 0, shown_on: int = 1) -> None:
        self._in = keys_from
        self._out = shown_on
        self._shown = ""

    def __enter__(self) -> Terminal:
        self._before = termios.tcgetattr(self._in)
        single = termios.tcgetattr(self._in)
        single[_IFLAG] &= ~(termios.IXON | termios.ICRNL)  # Ctrl-S would freeze what is shown
        single[_LFLAG] &= ~(termios.ICANON | termios.ECHO)
        single[_CC][termios.VSUSP] = _DISABLED  # a suspended program stops no robot
        single[_CC][termios.VMIN], single[_CC][termios.VTIME] = 1, 0
        termios.tcsetattr(self._in, termios.TCSANOW, single)
        return self

    def __exit__(
        self, _kind: type | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self._write("\n")
        with contextlib.suppress(termios.error):  # it is gone
            termios.tcsetattr(self._in, termios.TCSAFLUSH, self._before)

    @property
    def width(self) -> int:
        """The width of the terminal, in characters."""
        return shutil.get_terminal_size().columns or _WIDTH

    def read(self, seconds: float) -> bytes | None:
        """Returns what was typed within that time; None once the terminal is gone."""
        ready, _, _ = select.select([self._in], [], [], seconds)
        if not ready:
            return b""
        try:
            return os.read(self._in, 4096) or None
        except OSError:
            return None

    def show(self, text: str) -> None:
        """Replaces the shown line."""
        if text != self._shown:
            self._shown = text
            self._write(f"\r\x1b[K{text}")

    def _write(self, text: str) -> None:
        with contextlib.suppress(OSError):  # it is gone; whoever is driven is stopped all the same
            os.write(self._out, text.encode())
