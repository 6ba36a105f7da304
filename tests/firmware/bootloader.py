"""An UNO's boot loader on a pty: as much of STK500 version 1 (Atmel AVR061) as avrdude needs."""

from __future__ import annotations

import os
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

IN_SYNC, OK, END = b"\x14", b"\x10", 0x20
SIGNATURE = b"\x1e\x95\x0f"  # of an ATmega328P
PAGE = 128
# How many bytes follow a command's letter; pages tell theirs themselves.
LENGTHS = {0x30: 0, 0x41: 1, 0x42: 20, 0x45: 5, 0x50: 0, 0x51: 0, 0x55: 2, 0x56: 4, 0x74: 3, 0x75: 0}
WRITE_PAGE, READ_PAGE, LOAD_ADDRESS, SIGN, PARAMETER, UNIVERSAL = 0x64, 0x74, 0x55, 0x75, 0x41, 0x56


class Bootloader:
    """``memory`` is the flash. ``wears``: a byte of it that keeps what it held, as worn-out flash does."""

    def __init__(self, wears: int | None = None) -> None:
        self.memory = bytearray(b"\xff" * 32_768)
        self._wears = wears
        self._address = 0
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = Path(os.ttyname(self._slave))

    def serve(self) -> None:
        try:
            while True:
                self._answer(self._read(1)[0])
        except OSError:
            return

    def close(self) -> None:
        os.close(self._slave)
        os.close(self._master)

    def _read(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            data += os.read(self._master, count - len(data))
        return data

    def _answer(self, command: int) -> None:
        if command == WRITE_PAGE:
            head = self._read(3)
            body = head + self._read(int.from_bytes(head[:2], "big"))
        elif command in LENGTHS:
            body = self._read(LENGTHS[command])
        else:
            return
        if self._read(1)[0] == END:
            os.write(self._master, IN_SYNC + self._result(command, body) + OK)

    def _result(self, command: int, body: bytes) -> bytes:
        if command == LOAD_ADDRESS:
            self._address = 2 * int.from_bytes(body, "little")
        elif command == WRITE_PAGE:
            for offset, byte in enumerate(body[3:]):
                if self._address + offset != self._wears:
                    self.memory[self._address + offset] = byte
        elif command == READ_PAGE:
            return bytes(self.memory[self._address : self._address + int.from_bytes(body[:2], "big")])
        elif command == SIGN:
            return SIGNATURE
        elif command == PARAMETER:
            return b"\x04" if body[0] in (0x81, 0x82) else b"\x03"
        elif command == UNIVERSAL:
            return SIGNATURE[body[2] : body[2] + 1] if body[0] == 0x30 else b"\x00"
        return b""


@contextmanager
def bootloader(wears: int | None = None) -> Iterator[Bootloader]:
    board = Bootloader(wears)
    threading.Thread(target=board.serve, daemon=True).start()
    try:
        yield board
    finally:
        board.close()
