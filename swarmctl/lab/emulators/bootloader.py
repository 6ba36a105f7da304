"""An UNO's boot loader: STK500 version 1 (Atmel AVR061), the part that optiboot implements.

No clock, no line.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator

FLASH = 32_768  # bytes of an ATmega328P
PAGE = 128  # bytes, erased and written as one
WAIT = 1.0  # s without a byte after which optiboot starts the sketch
LEAVES = 0.016  # s until it does so on request: the shortest watchdog
BYTE = 10 / 115_200  # s on the line
PAGE_WRITE = 0.0045  # s to write a page at most (ATmega328P data sheet, tWD_FLASH)

END = 0x20
IN_SYNC, OK = b"\x14", b"\x10"
SIGNATURE = b"\x1e\x95\x0f"  # of an ATmega328P
PARAMETER, DEVICE, EXTENDED, LEAVE, ADDRESS, UNIVERSAL = 0x41, 0x42, 0x45, 0x51, 0x55, 0x56
WRITE_PAGE, READ_PAGE, READ_SIGNATURE = 0x64, 0x74, 0x75
HEAD = {PARAMETER: 1, DEVICE: 20, EXTENDED: 5, ADDRESS: 2, UNIVERSAL: 4, WRITE_PAGE: 3, READ_PAGE: 3}
VERSION = {0x81: b"\x04", 0x82: b"\x04"}  # by parameter; all others are 3

Session = Generator[bytes, int, None]


class Bootloader:
    """Writes ``memory`` on a programmer's requests while it is ``active``: from ``enter`` until the sketch
    starts.

    ``worn`` is the address of a byte that cannot be written, as in worn-out flash; None: there is none.
    """

    def __init__(self, memory: bytearray, wait: float = WAIT) -> None:
        self.memory = memory
        self.worn: int | None = None
        self.active = False
        self.has_written = False  # memory that no sketch was started from
        self._wait = self._time_left = wait
        self._received: deque[int] = deque()
        self._spare = 0.0  # s in hand for the received bytes
        self._session = self._run_session()

    def enter(self) -> None:
        """Starts it: the board was reset from outside."""
        self.active = True
        self._time_left, self._spare = self._wait, 0.0
        self._received.clear()
        self._session = self._run_session()
        next(self._session)

    def run_for(self, dt: float, data: bytes) -> bytes:
        """Runs for ``dt`` seconds in which it receives ``data``. Returns what it sends."""
        self._received += data
        self._time_left -= dt
        self._spare += dt
        reply = b""
        while self.active and self._received and self._spare > 0.0:
            reply += self._take(self._received.popleft())
        if not self._received:
            self._spare = min(self._spare, 0.0)
        if self._time_left <= 0.0:
            self.active = False
        return reply

    def _take(self, byte: int) -> bytes:
        self._time_left = self._wait
        try:
            reply = self._session.send(byte)
        except StopIteration:
            self.active = False
            return b""
        self._spare -= BYTE * (1 + len(reply))
        return reply

    def _run_session(self) -> Session:
        """Takes byte after byte and yields the reply to each; ends at a byte that is not STK500."""
        reply, address = b"", 0
        while True:
            command = yield reply
            body = yield from _bytes(HEAD.get(command, 0))
            if command == WRITE_PAGE:
                data = yield from _bytes(int.from_bytes(body[:2], "big"))
            if (yield b"") != END:
                return
            result = b""
            if command == ADDRESS:
                address = 2 * int.from_bytes(body, "little")  # addresses count words
            elif command == WRITE_PAGE:
                self._write(address, data)
            elif command == READ_PAGE:
                result = bytes(self.memory[address : address + int.from_bytes(body[:2], "big")])
            elif command == READ_SIGNATURE:
                result = SIGNATURE
            elif command == PARAMETER:
                result = VERSION.get(body[0], b"\x03")
            elif command == UNIVERSAL:
                result = b"\x00"
            elif command == LEAVE:
                self._time_left = LEAVES
            reply = IN_SYNC + result + OK

    def _write(self, address: int, data: bytes) -> None:
        self.has_written = True
        self._spare -= PAGE_WRITE
        for at, byte in enumerate(data, address):
            if at != self.worn and at < FLASH:
                self.memory[at] = byte


def _bytes(count: int) -> Generator[bytes, int, bytes]:
    """Returns the next ``count`` bytes, without a reply."""
    taken = bytearray()
    while len(taken) < count:
        taken.append((yield b""))
    return bytes(taken)
