"""The command that writes a firmware to a board, and the files that it reads. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

MCU = "atmega328p"
_PAGE = 128  # bytes that a boot loader writes at once
_GUARD = "0xff,0xcf"  # `rjmp` to itself
_DATA = b"00"  # records of Intel HEX that are not, have no place


@dataclass(frozen=True)
class Writing:
    """How to write a firmware to a board: ``files`` by name, in the folder where ``command`` runs.

    While the rest of the firmware is written, the board's first page, where it starts, holds a program that
    does nothing; the real page is written last. So a half-written board does not drive.
    """

    files: Mapping[str, bytes]
    command: tuple[str, ...]


def writing(name: str, firmware: bytes, port: str, programmer: str, speed: int) -> Writing:
    """Writes ``firmware`` (Intel HEX) and reads it back; avrdude fails if the board holds anything else."""
    rest, first = f"{name}.rest.hex", f"{name}.first.hex"
    command = [
        "avrdude", "-p", MCU, "-c", programmer, "-P", port, "-b", str(speed), "-D",
        "-U", f"flash:w:{_GUARD}:m", "-U", f"flash:w:{rest}:i", "-U", f"flash:w:{first}:i",
    ]  # fmt: skip
    return Writing(dict(zip((rest, first), _parts(firmware), strict=True)), tuple(command))


def _parts(firmware: bytes) -> tuple[bytes, bytes]:
    """All but the first page, and the first page, each a file of its own."""
    lines = firmware.split()
    on_first = [line[7:9] == _DATA and int(line[3:7], 16) < _PAGE for line in lines]
    end = lines[-1]
    rest = [line for line, first in zip(lines, on_first, strict=True) if not first]
    first = [line for line, first in zip(lines, on_first, strict=True) if first]
    return b"\n".join([*rest, b""]), b"\n".join([*first, end, b""])
