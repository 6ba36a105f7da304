"""What may go wrong on a serial line, as a value."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, fields
from random import Random
from typing import Any


@dataclass(frozen=True)
class Faults:
    """Probabilities (0..1, drawn for each reply) and times (s). As made, replies go out at once and whole.

    An ``error`` stands in place of the answer although the command was carried out; ``vanish`` unplugs the
    port, with the command carried out too.
    """

    delay: float = 0.0  # before each reply
    drop: float = 0.0  # no reply
    error: float = 0.0  # the robot's error reply instead of the answer
    truncate: float = 0.0  # half of the reply, then silence
    garbage: float = 0.0  # some random bytes first
    vanish: float = 0.0  # the cable is pulled instead of a reply
    split: int = 1  # pieces each reply is written in
    gap: float = 0.01  # between the pieces
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("drop", "error", "truncate", "garbage", "vanish"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(
                    f"fault {name!r} is a probability between 0 and 1, not {getattr(self, name)!r}"
                )
        for name in ("delay", "gap"):
            if not 0.0 <= getattr(self, name) <= 3600.0:
                raise ValueError(
                    f"fault {name!r} is a time between 0 and 3600 s, not {getattr(self, name)!r}"
                )
        if self.split < 1:
            raise ValueError(f"fault 'split' is a number of pieces from 1 on, not {self.split!r}")

    @classmethod
    def parse(cls, settings: Iterable[str]) -> Faults:
        """Faults from ``name=value`` texts; ``ValueError`` says what is wrong with one."""
        kinds: dict[str, type[int] | type[float]] = {
            field.name: int if isinstance(field.default, int) else float for field in fields(cls)
        }
        values: dict[str, Any] = {}
        for setting in settings:
            name, _, value = setting.partition("=")
            if name not in kinds:
                near = difflib.get_close_matches(name, kinds, 1)
                meant = f"; did you mean {near[0]!r}?" if near else ""
                raise ValueError(f"unknown fault {name!r}{meant} There are: {', '.join(kinds)}")
            try:
                values[name] = kinds[name](value)
            except ValueError:
                raise ValueError(f"fault {name!r} needs a number, as in {name}=1, not {value!r}") from None
        return cls(**values)

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
        size = -(-len(answer) // self.split) or 1
        cuts = [answer[start : start + size] for start in range(0, len(answer), size)]
        return [(self.gap if index else self.delay, cut) for index, cut in enumerate(cuts)]
