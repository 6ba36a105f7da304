"""What a flash does, read before it is done: the files, the command, and the steps around them."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.deploy.flash import Job
from swarmctl.firmware import avrdude
from swarmctl.firmware.compiler import Built
from swarmctl.lab.emulators.bootloader import PAGE
from swarmctl.lab.emulators.uno import image
from swarmctl.views import firmware as view

GOLDEN = Path(__file__).parent / "golden"


def hex_of(program: bytes) -> bytes:
    """Intel HEX, 16 bytes a line, as avr-objcopy writes it."""
    lines = []
    for at in range(0, len(program), 16):
        data = program[at : at + 16]
        record = bytes([len(data), at >> 8, at & 0xFF, 0]) + data
        lines.append(b":%s%02X\r\n" % (record.hex().upper().encode(), -sum(record) & 0xFF))
    return b"".join([*lines, b":00000001FF\r\n"])


@given(st.binary(min_size=PAGE + 1, max_size=1000))
def test_the_first_page_is_a_file_of_its_own_and_nothing_is_lost(
    tmp_path_factory: pytest.TempPathFactory, program: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "part.hex"
    parts = []
    for content in avrdude.writing("rover", hex_of(program), "/dev/x", "arduino", 115_200).files.values():
        file.write_bytes(content)
        parts.append(image(file))
    assert parts == [b"\xff" * PAGE + program[PAGE:], program[:PAGE]]


def test_the_first_page_is_written_last_and_does_nothing_before() -> None:
    command = avrdude.writing("rover", hex_of(bytes(300)), "/dev/x", "arduino", 115_200).command
    writes = [word for before, word in pairwise(command) if before == "-U"]
    assert writes == ["flash:w:0xff,0xcf:m", "flash:w:rover.rest.hex:i", "flash:w:rover.first.hex:i"]


def test_the_command_can_be_copied_into_a_shell() -> None:
    writing = avrdude.writing("rover", hex_of(bytes(300)), "/dev/swarm/rover", "", 57_600)
    steps = view.steps(Job("lab", "rover", "pi", "unit", "/dev/swarm/rover", "0123", writing), "pi")
    [command] = [line.split(maxsplit=1)[1] for line in steps.splitlines() if line.startswith("  run")]
    assert tuple(shlex.split(command)) == writing.command


def test_what_a_flash_does_can_be_read_before(golden: Callable[[Path, str], None]) -> None:
    writing = avrdude.writing("rover", hex_of(bytes(9156)), "/dev/swarm/rover", "arduino", 57_600)
    unit = "swarm-lab.rover.service"
    job = Job("lab", "rover", "rover-pi", unit, "/dev/swarm/rover", "0123456789ab", writing)
    built = Built(Path("build/rover.elf"), Path("build/firmware/rover.hex"), 9156, 401)
    shown = [view.built("rover", job.digest, built), view.steps(job, "rover-pi (ubuntu@192.168.77.30)")]
    golden(GOLDEN / "dry-run.txt", "\n".join(shown) + "\n")
