"""An UNO's boot loader: STK500 version 1 (Atmel AVR061), as far as optiboot speaks it. No clock, no wire."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator

FLASH = 32_768  # bytes of an ATmega328P
PAGE = 128  # bytes, erased and written as one
WAIT = 1.0  # s without a byte after which optiboot starts the sketch
LEAVES = 0.016  # s until it does so when told to: the shortest watchdog
BYTE = 10 / 115_200  # s that one takes on the line
PAGE_WRITE = 0.0045  # s that a page takes at most (ATmega328P data sheet, tWD_FLASH)

END = 0x20
IN_SYNC, OK = b"\x14", b"\x10"
SIGNATURE = b"\x1e\x95\x0f"  # of an ATmega328P
PARAMETER, DEVICE, EXTENDED, LEAVE, ADDRESS, UNIVERSAL = 0x41, 0x42, 0x45, 0x51, 0x55, 0x56
WRITE_PAGE, READ_PAGE, READ_SIGNATURE = 0x64, 0x74, 0x75
HEAD = {PARAMETER: 1, DEVICE: 20, EXTENDED: 5, ADDRESS: 2, UNIVERSAL: 4, WRITE_PAGE: 3, READ_PAGE: 3}
VERSION = {0x81: b"\x04", 0x82: b"\x04"}  # by parameter; all others are told as 3

Talk = Generator[bytes, int, None]


class Bootloader:
    """Writes ``memory`` as a programmer asks for it, while it is ``active``: from ``enter`` to its end.

    ``worn`` is the place of a byte that keeps what it holds, as worn-out flash does; None: there is none.
    """

    def __init__(self, memory: bytearray, wait: float = WAIT) -> None:
        self.memory = memory
        self.worn: int | None = None
        self.active = False
        self.has_written = False  # what no sketch has been started from yet
        self._wait = self._patience = wait
        self._heard: deque[int] = deque()
        self._spare = 0.0  # s that it has for the bytes it was sent
        self._talk = self._conversation()

    def enter(self) -> None:
        """The board was reset from outside."""
        self.active = True
        self._patience, self._spare = self._wait, 0.0
        self._heard.clear()
        self._talk = self._conversation()
        next(self._talk)

    def live(self, dt: float, data: bytes) -> bytes:
        """Let ``dt`` seconds pass in which it is sent ``data``. Gives what it says."""
        self._heard += data
        self._patience -= dt
        self._spare += dt
        said = b""
        while self.active and self._heard and self._spare > 0.0:
            said += self._take(self._heard.popleft())
        if not self._heard:
            self._spare = min(self._spare, 0.0)
        if self._patience <= 0.0:
            self.active = False
        return said

    def _take(self, byte: int) -> bytes:
        self._patience = self._wait
        try:
            said = self._talk.send(byte)
        except StopIteration:
            self.active = False
            return b""
        self._spare -= BYTE * (1 + len(said))
        return said

    def _conversation(self) -> Talk:
        """Takes byte after byte, gives what is said to each; over at the first that is no STK500."""
        said, address = b"", 0
        while True:
            command = yield said
            body = yield from _bytes(HEAD.get(command, 0))
            if command == WRITE_PAGE:
                data = yield from _bytes(int.from_bytes(body[:2], "big"))
            if (yield b"") != END:
                return
            result = b""
            if command == ADDRESS:
                address = 2 * int.from_bytes(body, "little")  # it counts words
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
                self._patience = LEAVES
            said = IN_SYNC + result + OK

    def _write(self, address: int, data: bytes) -> None:
        self.has_written = True
        self._spare -= PAGE_WRITE
        for at, byte in enumerate(data, address):
            if at != self.worn and at < FLASH:
                self.memory[at] = byte


def _bytes(count: int) -> Generator[bytes, int, bytes]:
    """The next ``count`` bytes; nothing is said to any."""
    taken = bytearray()
    while len(taken) < count:
        taken.append((yield b""))
    return bytes(taken)
