"""The command that writes a firmware to a board. Pure."""

from __future__ import annotations

MCU = "atmega328p"
PROGRAMMER = "arduino"  # the boot loader on a board's serial line, by STK500 version 1
SPEED = 115_200  # an UNO's; boards with the older loader have 57 600


def write(port: str, file: str, *, programmer: str = PROGRAMMER, speed: int = SPEED) -> list[str]:
    """Writes ``file`` (Intel HEX) and reads it back: avrdude fails if the board holds anything else then."""
    return [
        "avrdude", "-p", MCU, "-c", programmer, "-P", port, "-b", str(speed), "-D", "-U", f"flash:w:{file}:i"
    ]  # fmt: skip
