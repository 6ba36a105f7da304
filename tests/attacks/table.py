"""What became of each attack, and the table of all of them. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """What an attack achieved, judged by what is true outside the attacker."""

    SUCCEEDS = "succeeds"
    PARTLY = "partly"  # the swarm has changed, and not as was meant
    REFUSED = "refused"
    DECLARED = "declared"  # it reaches what the graph lets its host reach
    NONE = "-"  # it does not apply


class Setting(Enum):
    """`security` of the swarm that is attacked."""

    OFF = "off"
    FILTERED = "filtered"
    SEALED = "sealed"


@dataclass(frozen=True)
class Attack:
    """An attack's function in ``intruder.py``, and what it is. ``reads``: it only reads what hosts may read.

    ``commanded``: while a commander drives the robot; ``local``: by accounts of the host; ``squats``: by
    those of the master's host.
    """

    call: str
    what: str
    reads: bool = False
    commanded: bool = False
    local: bool = False
    squats: bool = False

    def applies(self, position: str) -> bool:
        if self.squats:
            return position in _OF_MASTERS_HOST
        return position != "c3" and (not self.local or position.startswith("c"))


Cells = Mapping[tuple[str, str, Setting], Verdict]  # by the attack's function and the position's key

_SPOOFED = "b"
_COMPROMISED = "d"
_OF_MASTERS_HOST = ("c2", "c3")


def judged(attack: Attack, position: str, verdict: Verdict) -> Verdict:
    """``verdict``, as the position counts it: a declared host may read."""
    if attack.reads and position == _COMPROMISED and verdict is Verdict.SUCCEEDS:
        return Verdict.DECLARED
    return verdict


def failures(attacks: Sequence[Attack], positions: Mapping[str, str], cells: Cells) -> list[str]:
    """The attacks that succeed though `security` is to refuse them.

    Who has taken the address of a host reads what that host may read, if it is only filtered.
    """
    return [
        f"{setting.value}: {attack.what}, from {key}"
        for setting in (Setting.FILTERED, Setting.SEALED)
        for key in positions
        for attack in attacks
        if cells.get((attack.call, key, setting)) is Verdict.SUCCEEDS
        and not (attack.reads and key == _SPOOFED and setting is Setting.FILTERED)
    ]


def lines(attacks: Sequence[Attack], positions: Mapping[str, str], cells: Cells) -> Iterator[str]:
    """Yields the table: a row for each attack, for each position what happens at each level."""
    for key, what in positions.items():
        yield f"{key:2}  {what}"
    yield ""
    columns = [(key, setting) for key in positions for setting in Setting]
    wide = max(len(attack.what) for attack in attacks)
    yield _row("", [f"{key} {setting.value}" for key, setting in columns], wide)
    for attack in attacks:
        found = [cells.get((attack.call, *column), Verdict.NONE).value for column in columns]
        yield _row(attack.what, found, wide)
    yield ""
    for verdict in Verdict:
        if verdict is not Verdict.NONE:
            counts = [
                sum(cells.get((attack.call, *column)) is verdict for attack in attacks) for column in columns
            ]
            yield _row(verdict.value, [str(count) for count in counts], wide)


def _row(head: str, cells: Sequence[str], wide: int) -> str:
    return f"{head:{wide}}  {'  '.join(f'{cell:11}' for cell in cells)}".rstrip()
