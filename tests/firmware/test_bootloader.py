"""The boot loader of the simulated board, as a programmer meets it (Atmel AVR061, optiboot)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.bootloader import FLASH, PAGE, WAIT

SYNC, IN_SYNC = b"\x30\x20", b"\x14\x10"
GREETING = b"swarmctl firmware "

Boards = Callable[..., SimulatedBoard]


def ask(board: SimulatedBoard, request: bytes, seconds: float = 0.1) -> bytes:
    board.replies(request)
    return b"".join(board.run_for(seconds))


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        (SYNC, IN_SYNC),
        (b"\x41\x81\x20", b"\x14\x04\x10"),
        (b"\x42" + bytes(20) + b"\x20", IN_SYNC),
        (b"\x45" + bytes(5) + b"\x20", IN_SYNC),
        (b"\x50\x20", IN_SYNC),
        (b"\x75\x20", b"\x14\x1e\x95\x0f\x10"),
        (b"\x56\xa0\x03\xfc\x00\x20", b"\x14\x00\x10"),
        (b"\x55\x40\x00\x20\x64\x00\x02F\xaa\xbb\x20\x74\x00\x03F\x20", None),
    ],
)
def test_it_answers_after_a_reset_from_outside(boards: Boards, request_: bytes, answer: bytes | None) -> None:
    board = boards()
    after = bytes(board.bootloader.memory[PAGE + 2 : PAGE + 3])
    board.opened()
    replies = IN_SYNC + IN_SYNC + b"\x14\xaa\xbb" + after + b"\x10"  # written and read at word 0x40
    assert ask(board, request_) == (replies if answer is None else answer)


def test_without_a_programmer_the_sketch_starts(boards: Boards) -> None:
    board = boards()
    assert GREETING in ask(board, b"", 0.5), "switched on, it starts at once"
    board.opened()
    assert ask(board, b"", WAIT - 0.1) == b""
    assert GREETING in ask(board, b"", 0.6)


@pytest.mark.parametrize("sent", [b"\x51\x20", b"\xff\xfe\x00\x00\xff\x00\x00\xff"])
def test_it_starts_the_sketch_on_request_and_on_unknown_bytes(boards: Boards, sent: bytes) -> None:
    board = boards()
    board.opened()
    assert ask(board, SYNC) == IN_SYNC
    assert GREETING in ask(board, sent, 0.5)


def test_what_was_written_before_another_reset_is_what_starts(boards: Boards) -> None:
    board = boards()
    board.opened()
    assert ask(board, b"\x64\x00\x02F\xff\xcf\x20") == IN_SYNC  # `rjmp` to itself
    board.opened()
    assert ask(board, b"", WAIT + 1.0) == b""


def test_a_sketch_ignores_a_sync(boards: Boards) -> None:
    board = boards()
    board.run_for(0.5)
    assert IN_SYNC not in ask(board, SYNC)


def test_pages_take_their_time(boards: Boards) -> None:
    """At 115200 baud, and 4.5 ms to write one: as an UNO, so that a cable can be pulled in between."""
    board = boards()
    board.opened()
    page = b"\x55\x00\x00\x20\x64\x00\x80F" + bytes(PAGE) + b"\x20"
    board.replies(page * 70)
    replies = b"".join(board.run_for(1.0))
    assert 0 < replies.count(IN_SYNC) < 2 * 70
    assert (replies + b"".join(board.run_for(1.0))).count(IN_SYNC) == 2 * 70


def test_a_worn_byte_keeps_its_value_and_the_flash_has_an_end(boards: Boards) -> None:
    board = boards()
    board.opened()
    board.bootloader.worn, before = 3, board.bootloader.memory[3]
    ask(board, b"\x64\x00\x04F" + bytes([0, 0, 0, before ^ 0xFF]) + b"\x20")
    assert board.bootloader.memory[:4] == bytes([0, 0, 0, before])
    ask(board, b"\x55\xff\x3f\x20\x64\x00\x04F\x01\x02\x03\x04\x20")
    assert len(board.bootloader.memory) == FLASH
    assert board.bootloader.memory[-2:] == b"\x01\x02"


def test_a_program_that_crashes_is_dead_until_the_next_reset(boards: Boards) -> None:
    board = boards()
    board.opened()
    ask(board, b"\x64\x00\x80F" + b"\xf8\x94\x88\x95" * 32 + b"\x20\x51\x20")  # cli, sleep, again and again
    board.run_for(1.0)
    assert board.truth.drives == (0, 0)
    board.opened()
    assert ask(board, SYNC) == IN_SYNC
