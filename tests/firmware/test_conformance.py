"""`driver test` on the compiled firmware: every check passes, and what is wired wrongly is found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from swarmctl.conformance.results import Verdict
from swarmctl.firmware.compiler import Built
from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.uno import LEFT, RIGHT, Fault
from swarmctl.render.sketch import FirmwareSettings, sketch
from tests.conformance.board_benches import checked, config, tried

Boards = Callable[..., SimulatedBoard]
BOOT = 1.5  # s an UNO's boot loader takes
FAIL = Verdict.FAIL
LEFT_ON_3, RIGHT_ON_2 = replace(LEFT, encoder=3), replace(RIGHT, encoder=2)


def test_the_firmware_is_as_its_type_declares(boards: Boards, note: Callable[[str, str, str], None]) -> None:
    digest = sketch("rover", FirmwareSettings()).digest
    results = tried(boards(boot=BOOT), config(firmware=digest))
    assert {one.check for one in results.values() if one.verdict is not Verdict.OK} == set(), results
    assert results["firmware"].figure == f"{digest}, as in the spec"
    dead_man = results["dead-man of the firmware"].figure.partition(" from")[0]
    note("driver test: the rover's dead-man, last command to last pulse", dead_man, "0.4 s and braking")


@pytest.mark.parametrize(
    ("wiring", "row", "text"),
    [
        ({"left": LEFT_ON_3, "right": RIGHT_ON_2}, "left wheel alone", "each encoder in, at its own wheel"),
        ({"left": RIGHT_ON_2, "right": LEFT_ON_3}, "right wheel alone", "each encoder in, at its own wheel"),
        (
            {"left": replace(LEFT, encoder=4)},
            "left wheel alone", "warning of the sketch: the left wheel is driven",
        ),
        ({"right": replace(RIGHT, free=3.0)}, "forward, at the limit", "times as fast"),
    ],
    ids=["encoders exchanged", "motors exchanged", "no encoder", "weak motor"],
)  # fmt: skip
def test_wrong_wiring_is_found(boards: Boards, wiring: dict[str, object], row: str, text: str) -> None:
    """Pulses have no direction; but the firmware counts none of a wheel that it does not drive."""
    found, _ = checked("motion", boards(boot=BOOT, **wiring))
    assert found[row].verdict is FAIL, found
    assert text in found[row].fix


def test_a_broken_wire_is_found(boards: Boards) -> None:
    board = boards(boot=BOOT)
    board.faults = Fault.RIGHT_WIRE_BROKEN
    found, _ = checked("motion", board)
    assert found["right wheel alone"].verdict is FAIL


def test_another_dead_man_is_found(
    boards: Boards, build_firmware: Callable[[FirmwareSettings], Built]
) -> None:
    board = boards(build_firmware(FirmwareSettings(dead_man=1.0)).hex, boot=BOOT)
    found, _ = checked("dead-man of the firmware", board)
    assert found["dead-man of the firmware"].verdict is FAIL


def test_another_baud_rate_is_found(boards: Boards) -> None:
    board = boards(boot=BOOT, baud=115_200)
    found, stands = checked("motion", board)
    assert found["board"].verdict is FAIL
    assert stands
