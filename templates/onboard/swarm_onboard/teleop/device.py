"""A joystick read from the kernel, without SDL: Linux's joystick interface (Documentation/input/joydev)."""

from __future__ import annotations

import errno
import os
import struct
import time
from itertools import count, takewhile
from typing import Callable, Mapping, TypeVar

from swarm_onboard.teleop.gamepad import Pad, noticed

V = TypeVar("V")

_EVENT = struct.Struct("=IhBB")  # ms, value, type, number
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_FULL = 32767.0
_TRY_AGAIN = 1.0  # s
_HINTS = {
    errno.ENOENT: "it is not plugged in",
    errno.ENODEV: "it is not plugged in",
    errno.EACCES: "no permission to read it; its group is `input`",
}


class Device:
    """Opens a device that is there, waits for one that is not, and drops the state of one that is gone."""

    def __init__(self, path: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.path = path
        self.trouble = ""  # why there is no joystick
        self._clock = clock
        self._file: int | None = None
        self._next_try = clock()
        self._axes: dict[int, float] = {}
        self._buttons: dict[int, int] = {}
        self._rest = b""
        self._pad: Pad | None = None

    def poll(self) -> Pad | None:
        """Returns the present state of the joystick; None while it is away. Does not wait."""
        try:
            if self._file is None and self._clock() >= self._next_try:
                self._file = os.open(self.path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
            if self._file is not None:
                self._read(self._file)
        except OSError as error:
            self._lose(_HINTS.get(error.errno or 0, error.strerror or str(error)))
        if self._file is None:
            return None
        self._pad = noticed(self._pad, _known(self._axes), _known(self._buttons), self._clock())
        return self._pad

    def close(self) -> None:
        """Closes the device."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _read(self, file: int) -> None:
        """Everything that has happened. The kernel begins with the state of each button and axis."""
        while True:
            try:
                data = os.read(file, 64 * _EVENT.size)
            except BlockingIOError:
                return
            if not data:
                raise OSError(errno.ENODEV, "end of file")
            self._rest += data
            whole = len(self._rest) // _EVENT.size * _EVENT.size
            for _, value, kind, number in _EVENT.iter_unpack(self._rest[:whole]):
                self._happened(value, kind & ~_INITIAL, number)
            self._rest = self._rest[whole:]

    def _happened(self, value: int, kind: int, number: int) -> None:
        if kind == _BUTTON:
            self._buttons[number] = value
        elif kind == _AXIS:
            # Forward and left are positive, as in joy_node's messages; the kernel has it the other way.
            self._axes[number] = max(-1.0, -value / _FULL)

    def _lose(self, why: str) -> None:
        self.close()
        self._forget()
        self.trouble = f"{self.path}: {why}"
        self._next_try = self._clock() + _TRY_AGAIN

    def _forget(self) -> None:
        self._axes, self._buttons = {}, {}
        self._rest, self._pad = b"", None


def _known(values: Mapping[int, V]) -> tuple[V, ...]:
    """The values by number, up to the first that nothing is known of."""
    return tuple(values[number] for number in takewhile(values.__contains__, count()))
