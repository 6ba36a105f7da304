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
    """One line of the table: the check, its verdict, the figure, and how to fix it."""

    check: str
    verdict: Verdict
    figure: str = ""
    fix: str = ""

    def to_json(self) -> dict[str, Any]:
        """Returns the entry of ``driver test --json``."""
        return asdict(self) | {"verdict": self.verdict.value}


def passed(results: Iterable[Result]) -> bool:
    """Returns whether no result is a failure."""
    return all(one.verdict is not Verdict.FAIL for one in results)
