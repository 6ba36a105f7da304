"""One serial port: exclusive, every call bounded in time, every fault a ``PortError`` with its reason."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import select
import termios
from typing import Iterator

import serial

from swarm_onboard.driver.config import Serial

_PARITIES = {"none": serial.PARITY_NONE, "even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD}
_WRITE_TIMEOUT = 0.2
_BLUETOOTH, _RADIOS = "/dev/rfcomm", "/sys/class/bluetooth"
# pyserial lets termios.error through, which is no OSError.
_FAULTS = (OSError, serial.SerialException, termios.error)


class PortError(Exception):
    """The port cannot be opened, or is gone. ``busy`` and ``absent`` distinguish the two harmless reasons.

    ``missing``: absent, and not even its name is there.
    """

    def __init__(
        self, reason: str, *, busy: bool = False, absent: bool = False, missing: bool = False
    ) -> None:
        super().__init__(reason)
        self.busy = busy
        self.absent = absent or missing
        self.missing = missing


class Port:
    """An open serial port. The first call that meets a vanished device raises ``PortError``."""

    def __init__(self, path: str, line: Serial) -> None:
        self._path = path
        try:
            with _turn(path):
                self._serial = serial.Serial(
                    port=path,
                    baudrate=line.baud,
                    bytesize=line.bytesize,
                    parity=_PARITIES[line.parity],
                    stopbits=line.stopbits,
                    timeout=0,
                    write_timeout=_WRITE_TIMEOUT,
                    exclusive=True,
                )
        except (*_FAULTS, ValueError) as error:
            raise _open_error(path, error) from error

    def write(self, data: bytes) -> None:
        """Writes all of ``data``. Raises ``PortError``."""
        try:
            self._serial.write(data)
        except serial.SerialTimeoutException as error:
            raise PortError(f"{self._path} takes no bytes: is the robot's end stuck?") from error
        except _FAULTS as error:
            raise self._gone(error) from error

    def read(self, timeout: float) -> bytes:
        """Waits up to ``timeout`` seconds for the first byte. Returns what has arrived, possibly nothing."""
        try:
            ready, _, _ = select.select([self._serial.fileno()], [], [], max(0.0, timeout))
            return bytes(self._serial.read(max(1, self._serial.in_waiting))) if ready else b""
        except _FAULTS as error:
            raise self._gone(error) from error

    def drain(self) -> None:
        """Discards unsolicited bytes: a banner, or an answer that came too late."""
        try:
            self._serial.reset_input_buffer()
        except _FAULTS as error:
            raise self._gone(error) from error

    def fileno(self) -> int:
        """Returns the file descriptor."""
        return int(self._serial.fileno())

    def close(self) -> None:
        """Closes the port; errors of a vanished device are ignored."""
        with contextlib.suppress(*_FAULTS):  # what is gone is closed
            self._serial.close()

    def _gone(self, error: Exception) -> PortError:
        return PortError(f"{self._path} is gone ({_short(error)})", absent=True)


@contextlib.contextmanager
def _turn(path: str) -> Iterator[None]:
    """Opens one Bluetooth line at a time on a host: connecting disturbs other lines that connect."""
    if not path.startswith(_BLUETOOTH):
        yield
        return
    descriptor = os.open(_RADIOS if os.access(_RADIOS, os.R_OK) else os.devnull, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise PortError(
            f"{path} waits for its turn: another Bluetooth line is being opened", absent=True
        ) from None
    try:
        yield
    finally:
        os.close(descriptor)


def _open_error(path: str, error: Exception) -> PortError:
    number = _number(error) or _number(error.__context__)
    if number == errno.ENOENT or not os.path.lexists(path):
        return PortError(f"{path} is missing: is the cable plugged in, the robot on?", missing=True)
    if number == errno.EACCES:
        return PortError(f"no permission for {path}: the driver's account must be in its group (dialout)")
    if number in (errno.EAGAIN, errno.EBUSY):
        return PortError(f"{path} is in use by another program (see `fuser {path}`)", busy=True)
    if number == errno.ENOTTY:
        return PortError(f"{path} is not a serial port")
    unplugged = number in (errno.EIO, errno.ENODEV, errno.ENXIO, errno.EHOSTDOWN, errno.EHOSTUNREACH)
    return PortError(f"cannot open {path}: {_short(error)}", absent=unplugged)


def _short(error: Exception) -> str:
    number = _number(error)
    return os.strerror(number) if number else str(error)


def _number(error: BaseException | None) -> int | None:
    """Returns the errno of ``error``; termios.error has it only as its first argument."""
    given = getattr(error, "errno", None) or next(iter(getattr(error, "args", ())), None)
    return given if isinstance(given, int) else None
