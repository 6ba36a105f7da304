"""The compiler of sketches for an Arduino UNO: finds it and the Arduino core, and builds with them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
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


MCU = "atmega328p"
F_CPU = 16_000_000
FLASH = 32_256  # bytes: 32 KB less the boot loader's 512
RAM = 2_048

# The Arduino IDE's own (platform.txt), without what hides warnings.
_COMMON = (
    f"-mmcu={MCU} -DF_CPU={F_CPU}L -DARDUINO=10808 -DARDUINO_AVR_UNO -DARDUINO_ARCH_AVR "
    "-Os -g -flto -fuse-linker-plugin -ffunction-sections -fdata-sections -fno-fat-lto-objects"
).split()
_CXX = ["-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics"]
_CORE = [
    "-w",
    "-DDECIMAL_DIG=__DECIMAL_DIG__",
]  # WString.cpp expects that of <float.h>, and Debian's GCC 5 has none
_WARNINGS = ["-Wall", "-Wextra"]


@dataclass(frozen=True)
class Built:
    """A firmware on disk and its sizes in bytes: flash, static data in RAM."""

    elf: Path
    hex: Path
    flash: int
    data: int


def build(name: str, sources: Mapping[str, bytes], out: Path, toolchain: Toolchain) -> Built:
    """Compile ``sources`` (path -> text) into ``out/<name>.elf`` and ``.hex``. Raises FirmwareError."""
    out.mkdir(parents=True, exist_ok=True)
    elf, hexfile = out / f"{name}.elf", out / f"{name}.hex"
    with tempfile.TemporaryDirectory(prefix="swarmctl-firmware-") as folder:
        work = Path(folder)
        core = _compile_core(toolchain, work / "core")
        objects = _compile_sketch(toolchain, work / "sketch", sources)
        _run([*_cxx(toolchain), "-Wl,--gc-sections", "-o", str(elf), *objects, str(core), "-lm"])
    _run([toolchain.tool("avr-objcopy"), "-O", "ihex", "-R", ".eeprom", str(elf), str(hexfile)])
    built = Built(elf, hexfile, *_sizes(toolchain, elf))
    if built.flash > FLASH or built.data > RAM:
        raise FirmwareError(
            f"the firmware does not fit: {built.flash} of {FLASH} B flash, {built.data} of {RAM} B RAM"
        )
    return built


def _compile_core(toolchain: Toolchain, work: Path) -> Path:
    """The Arduino core as an archive: a sketch that has an interrupt itself does not get the core's."""
    work.mkdir()
    core = toolchain.core / "cores/arduino"
    c, cxx = (sorted(str(path) for path in core.glob(f"*.{ending}")) for ending in ("c", "cpp"))
    _run([toolchain.tool("avr-gcc"), *_COMMON, "-std=gnu11", *_CORE, *_includes(toolchain), "-c", *c], work)
    _run([*_cxx(toolchain), *_CORE, *_includes(toolchain), "-c", *cxx], work)
    _run([toolchain.tool("avr-gcc-ar"), "rcs", "core.a", *_objects(work)], work)
    return work / "core.a"


def _compile_sketch(toolchain: Toolchain, work: Path, sources: Mapping[str, bytes]) -> list[str]:
    for path, content in sources.items():
        (work / path).parent.mkdir(parents=True, exist_ok=True)
        (work / path).write_bytes(content)
    units = sorted(path for path in sources if path.endswith((".ino", ".cpp")))
    _run([*_cxx(toolchain), *_WARNINGS, *_includes(toolchain), "-c", "-x", "c++", *units], work)
    return _objects(work)


def _includes(toolchain: Toolchain) -> list[str]:
    return [f"-I{toolchain.core / folder}" for folder in ("cores/arduino", "variants/standard")]


def _cxx(toolchain: Toolchain) -> list[str]:
    return [toolchain.tool("avr-g++"), *_COMMON, *_CXX]


def _objects(work: Path) -> list[str]:
    return sorted(str(path) for path in work.glob("*.o"))


def _run(command: list[str], cwd: Path | None = None) -> str:
    ran = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if ran.returncode:
        lines = (ran.stderr or ran.stdout).strip().splitlines()
        raise FirmwareError(f"{Path(command[0]).name} failed", *lines[:20])
    return ran.stdout


def _sizes(toolchain: Toolchain, elf: Path) -> tuple[int, int]:
    """Sizes of the sections in bytes: flash (text and data), RAM (data, bss and noinit)."""
    listed = _run([toolchain.tool("avr-size"), "-A", str(elf)])
    size = {name: int(bytes_) for name, bytes_ in re.findall(r"^(\.\w+)\s+(\d+)", listed, re.MULTILINE)}
    data = size.get(".data", 0)
    return size.get(".text", 0) + data, data + size.get(".bss", 0) + size.get(".noinit", 0)
