"""What counts as a failure, and that every attack has its function and its judge."""

from __future__ import annotations

import pytest

from tests.attacks.attacks import ATTACKS, JUDGES
from tests.attacks.intruder import ATTACKS as CALLS
from tests.attacks.positions import POSITIONS
from tests.attacks.table import Attack, Setting, Verdict, failures, judged, lines

DRIVE, READ = Attack("drive", "drive the robot"), Attack("look", "read the odometry", reads=True)
TAMPER = Attack("tamper", "change files", local=True)
PLACES = {"a": "a foreign machine", "b": "one with another's address", "c1": "an account", "d": "root"}


def test_every_attack_has_a_function_and_a_judge() -> None:
    assert {one.call for one in ATTACKS} == set(CALLS) == set(JUDGES)
    assert len({one.key for one in POSITIONS}) == len(POSITIONS)


def test_accounts_alone_attack_what_is_on_their_host() -> None:
    assert [key for key in PLACES if TAMPER.applies(key)] == ["c1"]
    assert [key for key in PLACES if DRIVE.applies(key)] == list(PLACES)


def test_a_declared_host_may_read_and_not_drive() -> None:
    assert judged(READ, "d", Verdict.SUCCEEDS) is Verdict.DECLARED
    assert judged(READ, "d", Verdict.REFUSED) is Verdict.REFUSED
    assert judged(READ, "c1", Verdict.SUCCEEDS) is Verdict.SUCCEEDS
    assert judged(DRIVE, "d", Verdict.SUCCEEDS) is Verdict.SUCCEEDS


@pytest.mark.parametrize(
    ("attack", "position", "setting", "fails"),
    [
        (DRIVE, "a", Setting.FILTERED, True),
        (DRIVE, "a", Setting.OFF, False),
        (DRIVE, "b", Setting.FILTERED, True),
        (READ, "b", Setting.FILTERED, False),
        (READ, "a", Setting.FILTERED, True),
        (READ, "c1", Setting.FILTERED, True),
        (READ, "b", Setting.SEALED, True),
        (DRIVE, "b", Setting.SEALED, True),
    ],
)
def test_it_fails_if_what_is_to_be_refused_succeeds(
    attack: Attack, position: str, setting: Setting, fails: bool
) -> None:
    cells = {(attack.call, position, setting): Verdict.SUCCEEDS}
    assert failures([DRIVE, READ], PLACES, cells) == (
        [f"{setting.value}: {attack.what}, from {position}"] if fails else []
    )


def test_the_table_has_a_row_for_each_attack_and_each_total() -> None:
    cells = {
        ("drive", "a", Setting.OFF): Verdict.SUCCEEDS,
        ("tamper", "a", Setting.OFF): Verdict.SUCCEEDS,
        ("drive", "a", Setting.FILTERED): Verdict.REFUSED,
    }
    text = "\n".join(lines([DRIVE, TAMPER], {"a": PLACES["a"]}, cells))
    assert (
        text
        == """\
a   a foreign machine

                 a off        a filtered   a sealed
drive the robot  succeeds     refused      -
change files     succeeds     -            -

succeeds         2            0            0
partly           0            0            0
refused          0            1            0
declared         0            0            0"""
    )
