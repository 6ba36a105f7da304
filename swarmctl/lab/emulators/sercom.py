"""Parses the input of an e-puck: lines of text, and chained binary requests that end with a zero."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto

from swarmctl.lab.emulators.differential_drive import wrap
from swarmctl.lab.emulators.robot import TERMINATORS

LONGEST_LINE = 80
NEXT_NUMBER = re.compile(r",\s*([+-]?[0-9]+)")


@dataclass(frozen=True)
class Text:
    """A line, without its terminator."""

    line: str


@dataclass(frozen=True)
class Binary:
    """One command of a binary request."""

    letter: str
    payload: bytes


@dataclass(frozen=True)
class End:
    """The zero that ends a binary request, with the whole request."""

    request: bytes


class _Reading(Enum):
    """How the next byte is read."""

    START = auto()  # the first byte of a request decides between text and binary
    TEXT_START = auto()  # a CR or LF came first: whatever follows is text, even a binary request
    TEXT = auto()
    BINARY = auto()
    PAYLOAD = auto()


class Reader:
    """Text must end with CR or LF, not both: the second one begins a new text, which swallows a binary
    request after it. ``payloads`` has the number of bytes that follow a binary letter.
    """

    def __init__(self, payloads: Mapping[str, int]) -> None:
        self._payloads = payloads
        self._reading = _Reading.START
        self._line = bytearray()
        self._letter = ""
        self._payload = bytearray()

    def push(self, byte: int) -> Text | Binary | End | None:
        """Takes one byte; returns what it completes."""
        if self._reading is _Reading.BINARY:
            return self._binary(byte)
        if self._reading is _Reading.PAYLOAD:
            return self._binary_payload(byte)
        if self._reading is _Reading.TEXT:
            return self._text(byte)
        if self._reading is _Reading.START and byte & 0x80:
            self._reading = _Reading.BINARY
            self._line.clear()
            return self._binary(byte)
        if byte in TERMINATORS:
            self._reading = _Reading.TEXT_START
        elif byte or self._reading is _Reading.TEXT_START:
            self._line[:] = bytes([byte])
            self._reading = _Reading.TEXT
        return None

    def _append(self, byte: int) -> None:
        if len(self._line) < LONGEST_LINE:
            self._line.append(byte)

    def _text(self, byte: int) -> Text | None:
        if byte not in TERMINATORS:
            self._append(byte)
            return None
        self._reading = _Reading.START
        return Text(self._line.decode("latin-1"))

    def _binary(self, byte: int) -> Binary | End | None:
        self._append(byte)
        if byte == 0:
            self._reading = _Reading.START
            return End(bytes(self._line))
        letter = chr(-byte & 0xFF)
        if not self._payloads.get(letter):
            return Binary(letter, b"")
        self._reading = _Reading.PAYLOAD
        self._letter = letter
        self._payload.clear()
        return None

    def _binary_payload(self, byte: int) -> Binary | None:
        self._append(byte)
        self._payload.append(byte)
        if len(self._payload) < self._payloads[self._letter]:
            return None
        self._reading = _Reading.BINARY
        return Binary(self._letter, bytes(self._payload))


def scan(parameters: str, values: list[int], bits: int) -> None:
    """Read ``,number,number...`` into ``values``; from the first missing one on they stay, as C's sscanf
    leaves them.
    """
    position = 0
    for index in range(len(values)):
        match = NEXT_NUMBER.match(parameters, position)
        if match is None:
            return
        values[index] = wrap(int(match[1]), bits)
        position = match.end()
