"""Faults of a serial line, as a value."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from random import Random
from typing import Any

from swarmctl.lab.emulators.setting_values import number_or_switch, unknown

PROBABILITIES = (
    "late", "drop", "error", "truncate", "garbage", "banner", "vanish",
    "stray_ff", "bad_length", "bad_checksum", "overlong",
)  # fmt: skip
TIMES = ("delay", "late_by", "gap")
IN_FRAMES = ("stray_ff", "bad_length", "bad_checksum", "overlong", "wrong_md5", "no_time")


@dataclass(frozen=True)
class Faults:
    """Probabilities (0..1, drawn for each reply), times (s) and switches. By default nothing goes wrong.

    The robot executes the command whatever happens to its reply. Unsolicited output has the same faults
    except ``error``. The faults from ``stray_ff`` on apply to the frames of rosserial robots.
    """

    delay: float = 0.0  # before each reply
    late: float = 0.0  # a reply that comes too late
    late_by: float = 1.0  # how late
    drop: float = 0.0  # no reply
    error: float = 0.0  # the robot's error reply instead of the answer
    truncate: float = 0.0  # only half of the reply
    garbage: float = 0.0  # some random bytes first
    banner: float = 0.0  # the robot resets itself instead of a reply, and prints its banner
    vanish: float = 0.0  # the cable is pulled instead of a reply
    stuck: bool = False  # the robot reads no bytes
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
        """Returns faults from ``name=value`` texts. Raises ``ValueError`` for a wrong one."""
        return cls.of({name: value for name, _, value in (text.partition("=") for text in settings)})

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Faults:
        """Returns faults from names and values (possibly texts). Raises ``ValueError`` for a wrong one."""
        kinds = {field.name: type(field.default) for field in fields(cls)}
        values: dict[str, Any] = {}
        for name, value in settings.items():
            if name not in kinds:
                raise unknown("fault", name, kinds)
            try:
                values[name] = number_or_switch(kinds[name], value)
            except (ValueError, TypeError):
                raise ValueError(f"fault {name!r} needs a number, as in {name}=1, not {value!r}") from None
        return cls(**values)

    def checked(self, *, uses_rosserial: bool) -> Faults:
        """Returns itself. Raises ``ValueError`` for frame faults of a robot without rosserial frames."""
        in_frames = [name for name in IN_FRAMES if getattr(self, name)]
        if in_frames and not uses_rosserial:
            raise ValueError(f"fault {in_frames[0]!r} is for robots that use rosserial")
        return self

    def strikes(self, probability: float, random: Random) -> bool:
        """Draws whether a fault of ``probability`` happens."""
        return probability > 0.0 and random.random() < probability

    def pieces(self, answer: bytes, refusal: bytes | None, random: Random) -> list[tuple[float, bytes]]:
        """Returns what is sent instead of ``answer``: pieces, each with the seconds to wait before it.

        Unsolicited output has no ``refusal``, and no ``error`` then.
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
