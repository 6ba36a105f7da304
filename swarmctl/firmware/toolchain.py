"""Finds the compiler and the Arduino core on this machine."""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

CORE = Path("/usr/share/arduino/hardware/arduino/avr")  # Debian's arduino-core-avr
CORE_VARIABLE = "SWARMCTL_ARDUINO_CORE"
_PACKAGES = {
    "avr-gcc": "gcc-avr",
    "avr-g++": "gcc-avr",
    "avr-gcc-ar": "gcc-avr",
    "avr-objcopy": "binutils-avr",
    "avr-size": "binutils-avr",
}


class FirmwareError(Exception):
    """A build failed; ``help_lines`` show how to fix it."""

    def __init__(self, message: str, *help_lines: str) -> None:
        super().__init__(message)
        self.help_lines = help_lines


@dataclass(frozen=True)
class Toolchain:
    """The folder of the Arduino core, and the paths of the tools."""

    core: Path

    def tool(self, name: str) -> str:
        """The path of a tool. Raises FirmwareError with the package to install."""
        found = shutil.which(name)
        if found is None:
            raise FirmwareError(f"{name} is missing", f"sudo apt install {_PACKAGES[name]}")
        return found


def find(core: Path | None = None) -> Toolchain:
    """The tools of this machine. Raises ``FirmwareError`` if anything is missing."""
    chosen = core or Path(os.environ.get(CORE_VARIABLE) or CORE)
    toolchain = Toolchain(chosen)
    for name in _PACKAGES:
        toolchain.tool(name)
    if not (chosen / "cores/arduino/Arduino.h").is_file():
        raise FirmwareError(
            f"there is no Arduino core in {chosen}",
            f"sudo apt install arduino-core-avr, or name its folder: --core DIR or {CORE_VARIABLE}",
        )
    if not _has_libc(toolchain):
        raise FirmwareError("avr-libc is missing: there is no <avr/io.h>", "sudo apt install avr-libc")
    return toolchain


def _has_libc(toolchain: Toolchain) -> bool:
    command = [
        toolchain.tool("avr-gcc"),
        "-mmcu=atmega328p",
        "-E",
        "-include",
        "avr/io.h",
        "-x",
        "c",
        os.devnull,
    ]
    return not subprocess.run(command, capture_output=True, check=False).returncode
