"""How the looks at a swarm answer to a fault: after how many seconds they name it, and when it is gone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

HEALTHY = "healthy"
PATIENCE = 120.0  # s until the swarm must be healthy, before a fault and after its repair


@dataclass(frozen=True)
class Look:
    """One look at the swarm. ``causes``: the lines of the causes that are a warning or worse, worst first."""

    healthy: bool
    causes: tuple[str, ...]

    @property
    def first(self) -> str:
        """What it says first; ``healthy`` if nothing is wrong."""
        return self.causes[0] if self.causes else HEALTHY

    def says_first(self, line: str) -> bool:
        """Whether the first finding begins with ``line``."""
        return bool(self.causes) and self.causes[0].startswith(line)

    def is_free_of(self, line: str) -> bool:
        """Whether the swarm is healthy and no finding begins with ``line``."""
        return self.healthy and not any(cause.startswith(line) for cause in self.causes)


@dataclass(frozen=True)
class Response:
    """What status showed of a fault. Times in s; None: not named, or not recovered.

    ``first``: the first line of the last look that was not healthy; a fault may end by itself.
    ``detected``: from the fault to the end of the look that named it; ``recovered``: from the beginning of
    the repair to the end of the first healthy look.
    """

    name: str
    expected: str
    within: float
    first: str
    detected: float | None
    recovered: float | None

    @property
    def as_expected(self) -> bool:
        """Whether status named the fault in time, and the swarm recovered."""
        in_time = self.detected is not None and self.detected <= self.within
        return in_time and self.recovered is not None

    def to_json(self) -> dict[str, Any]:
        """Returns JSON data."""
        return {
            "name": self.name,
            "expected": self.expected,
            "first": self.first,
            "within": self.within,
            "detected": self.detected,
            "recovered": self.recovered,
            "as_expected": self.as_expected,
        }


@dataclass(frozen=True)
class Observer:
    """Looks at a swarm again and again. ``clock``: in s, such as ``time.monotonic``."""

    look: Callable[[], Look]
    clock: Callable[[], float]

    def until_healthy(self, line: str | None = None) -> tuple[Look, bool]:
        """Looks until the swarm is healthy, and free of ``line``; at most for ``PATIENCE``."""
        due = self.clock() + PATIENCE
        while True:
            seen = self.look()
            whole = seen.healthy if line is None else seen.is_free_of(line)
            if whole or self.clock() >= due:
                return seen, whole

    def response(
        self, name: str, line: str, within: float, begin: Callable[[], None], repair: Callable[[], None]
    ) -> Response:
        """Causes a fault, looks until it is named, repairs it, looks until the swarm has recovered.

        The fault is repaired also if a look fails.
        """
        try:
            begin()
            since, detected, first = self.clock(), None, HEALTHY
            while detected is None:
                seen = self.look()
                first = first if seen.first == HEALTHY else seen.first
                passed = self.clock() - since
                if seen.says_first(line):
                    detected = passed
                elif passed >= within:
                    break
        finally:
            since = self.clock()
            repair()
        whole = self.until_healthy(line)[1]
        recovered = self.clock() - since if whole else None
        return Response(name, line, within, first, detected, recovered)
