"""Lines that are wider than a terminal: where they go on."""

from __future__ import annotations

import pytest
from rich.cells import cell_len
from rich.text import Text

from swarmctl.views.width import wrapped

HELP = "help: on epuck-pi-1: ls /sys/class/bluetooth/ lists adapters; /tb3_[01-20]/odom for record is lost"


def lines(text: str, width: int, indent: int = 4) -> list[str]:
    return wrapped(Text(text), width, indent).plain.split("\n")


@pytest.mark.parametrize("width", [32, 40, 50, 80])
def test_paths_and_topics_are_not_divided(width: int) -> None:
    shown = lines(HELP, width)
    assert len(shown) > 1
    assert max(map(cell_len, shown)) <= width
    assert " ".join(map(str.strip, shown)) == HELP


def test_a_word_that_is_longer_than_a_line_goes_on_after_a_comma() -> None:
    long = f"hosts: {','.join(f'host:tb3-{n:02}' for n in range(12))}"
    shown = lines(long, 40)
    assert max(map(cell_len, shown)) <= 40
    assert "".join(map(str.strip, shown)) == long
    assert all(line.endswith(",") for line in shown[:-1])


def test_a_word_without_a_comma_is_cut() -> None:
    assert lines("x" * 20, 10, indent=2) == ["x" * 10, "  " + "x" * 8, "  " + "x" * 2]
