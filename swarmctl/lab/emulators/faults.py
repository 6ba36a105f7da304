"""What may go wrong on a serial line, as a value."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from random import Random
from typing import TYPE_CHECKING, Any

from swarmctl.lab.emulators.settings import number_or_switch

if TYPE_CHECKING:
    from swarmctl.lab.emulators.robot import Robot

PROBABILITIES = (
    "late", "drop", "error", "truncate", "garbage", "banner", "vanish",
    "stray_ff", "bad_length", "bad_checksum", "overlong",
)  # fmt: skip
TIMES = ("delay", "late_by", "gap")
IN_FRAMES = ("stray_ff", "bad_length", "bad_checksum", "overlong", "wrong_md5", "no_time")


@dataclass(frozen=True)
class Faults:
    """Probabilities (0..1, drawn for each reply), times (s) and switches. As made, nothing goes wrong.

    The command is carried out whatever becomes of its reply. What a robot says unasked meets the same, only
    no ``error``. Those from ``stray_ff`` on strike the frames of robots that speak rosserial, see there.
    """

    delay: float = 0.0  # before each reply
    late: float = 0.0  # a reply that comes after all patience
    late_by: float = 1.0  # how late
    drop: float = 0.0  # no reply
    error: float = 0.0  # the robot's error reply instead of the answer
    truncate: float = 0.0  # half of the reply, then silence
    garbage: float = 0.0  # some random bytes first
    banner: float = 0.0  # the robot resets itself instead of a reply, and prints its banner
    vanish: float = 0.0  # the cable is pulled instead of a reply
    stuck: bool = False  # the robot takes no bytes
    split: int = 1  # pieces each reply is written in
    gap: float = 0.01  # between the pieces
    stray_ff: float = 0.0  # an ff before the frame
    bad_length: float = 0.0  # the checksum of the length is wrong
    bad_checksum: float = 0.0  # the checksum at the end is wrong
    overlong: float = 0.0  # a frame longer than any buffer
    wrong_md5: bool = False  # topics are announced with other message definitions
    no_time: bool = False  # no time requests
    seed: int = 0

    def __post_init__(self) -> None:
        for name in PROBABILITIES:
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(
                    f"fault {name!r} is a probability between 0 and 1, not {getattr(self, name)!r}"
                )
        for name in TIMES:
            if not 0.0 <= getattr(self, name) <= 3600.0:
                raise ValueError(
                    f"fault {name!r} is a time between 0 and 3600 s, not {getattr(self, name)!r}"
                )
        if self.split < 1:
            raise ValueError(f"fault 'split' is a number of pieces from 1 on, not {self.split!r}")

    @classmethod
    def parse(cls, settings: Iterable[str]) -> Faults:
        """Faults from ``name=value`` texts; ``ValueError`` says what is wrong with one."""
        return cls.of({name: value for name, _, value in (text.partition("=") for text in settings)})

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Faults:
        """Faults from names and values, which may be texts; ``ValueError`` says what is wrong with one."""
        kinds = {field.name: type(field.default) for field in fields(cls)}
        values: dict[str, Any] = {}
        for name, value in settings.items():
            if name not in kinds:
                near = difflib.get_close_matches(name, kinds, 1)
                meant = f"; did you mean {near[0]!r}?" if near else "."
                raise ValueError(f"unknown fault {name!r}{meant} There are: {', '.join(kinds)}")
            try:
                values[name] = number_or_switch(kinds[name], value)
            except (ValueError, TypeError):
                raise ValueError(f"fault {name!r} needs a number, as in {name}=1, not {value!r}") from None
        return cls(**values)

    def fitting(self, robot: Robot) -> Faults:
        """Themselves, if ``robot`` can have them, else a ``ValueError``: some are for frames alone."""
        in_frames = [name for name in IN_FRAMES if getattr(self, name)]
        if in_frames and not robot.speaks_frames:
            raise ValueError(f"fault {in_frames[0]!r} is for robots that speak rosserial")
        return self

    def strikes(self, probability: float, random: Random) -> bool:
        """Whether a fault of ``probability`` happens this time."""
        return probability > 0.0 and random.random() < probability

    def pieces(self, answer: bytes, refusal: bytes | None, random: Random) -> list[tuple[float, bytes]]:
        """What goes out in place of ``answer``: pieces, each with the seconds to wait before it.

        Without a ``refusal``, as for what was said unasked, there is no error.
        """
        if self.strikes(self.drop, random):
            return []
        if refusal is not None and self.strikes(self.error, random):
            answer = refusal
        if self.strikes(self.truncate, random):
            answer = answer[: len(answer) // 2]
        if self.strikes(self.garbage, random):
            answer = random.randbytes(random.randint(1, 8)) + answer
        wait = self.delay + (self.late_by if self.strikes(self.late, random) else 0.0)
        size = -(-len(answer) // self.split) or 1
        cuts = [answer[start : start + size] for start in range(0, len(answer), size)]
        return [(self.gap if index else wait, cut) for index, cut in enumerate(cuts)]
