"""What a check says of one thing: its state, in words, and how to fix it. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

_MOST_NAMED = 3


class State(str, Enum):
    """``skipped``: absent as intended, or not checked; ``unknown``: could not be determined."""

    OK = "ok"
    SKIPPED = "skipped"
    WARNING = "warning"
    UNKNOWN = "unknown"
    BAD = "bad"


@dataclass(frozen=True)
class Verdict:
    """The result of a check, with a hint how to fix what is wrong."""

    state: State
    message: str
    hint: str = ""

    @property
    def fine(self) -> bool:
        """True if the check passed."""
        return self.state is State.OK

    def bearable(self) -> Verdict:
        """Returns the same verdict for an optional part: a warning instead of bad."""
        return replace(self, state=State.WARNING) if self.state is State.BAD else self


def ok(message: str) -> Verdict:
    """Returns a verdict without problems."""
    return Verdict(State.OK, message)


def bad(message: str, hint: str = "") -> Verdict:
    """Returns a verdict that makes the swarm unhealthy."""
    return Verdict(State.BAD, message, hint)


def warning(message: str, hint: str = "") -> Verdict:
    """Returns a verdict that is shown, and leaves the swarm healthy."""
    return Verdict(State.WARNING, message, hint)


def unknown(message: str) -> Verdict:
    """Returns the verdict for a host without an answer."""
    return Verdict(State.UNKNOWN, message)


def listed(texts: Sequence[str]) -> str:
    """Returns the texts with commas between them; of many the first three, and how many more there are."""
    more = [f"{len(texts) - _MOST_NAMED} more"] if len(texts) > _MOST_NAMED else []
    return ", ".join([*texts[:_MOST_NAMED], *more])
