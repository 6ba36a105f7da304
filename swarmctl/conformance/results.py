"""Results of checks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any


class Verdict(Enum):
    """The result of one check."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Result:
    """One line of the table: the check, its verdict, the figure, how to fix it, and the bytes it received."""

    check: str
    verdict: Verdict
    figure: str = ""
    fix: str = ""
    received: bytes | None = None  # of the exchange that failed

    def to_json(self) -> dict[str, Any]:
        """Returns the entry of ``driver test --json``."""
        known = {key: value for key, value in asdict(self).items() if key != "received"}
        received = {} if self.received is None else {"received": self.received.hex(" ")}
        return known | received | {"verdict": self.verdict.value}


def ok(check: str, figure: str) -> Result:
    """Returns the result of a check that passed."""
    return Result(check, Verdict.OK, figure)


def warn(check: str, figure: str, fix: str = "") -> Result:
    """Returns a warning, which does not fail the test."""
    return Result(check, Verdict.WARN, figure, fix)


def fail(check: str, figure: str, fix: str = "", received: bytes | None = None) -> Result:
    """Returns the result of a check that failed."""
    return Result(check, Verdict.FAIL, figure, fix, received)


def passed(results: Iterable[Result]) -> bool:
    """Returns whether no result is a failure."""
    return all(one.verdict is not Verdict.FAIL for one in results)
