"""What is seen of robots and of a process, again and again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from statistics import fmean

from tests.e2e.experiment import STILL
from tests.timing import RunQueue


@dataclass(frozen=True)
class Weight:
    """What a relay holds: MB resident, file descriptors, threads."""

    resident: float
    files: int
    threads: int


def weight(pid: int) -> Weight:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    values = dict(line.split(":", 1) for line in lines)
    files = len(list(Path(f"/proc/{pid}/fd").iterdir()))
    return Weight(int(values["VmRSS"].split()[0]) / 1024, files, int(values["Threads"]))


@dataclass(frozen=True)
class Look:
    """Who moves at a moment, s, and how far each robot has come, m."""

    moment: float
    moving: frozenset[str]
    ways: Mapping[str, float]


@dataclass
class Stretch:
    """A time, s, in which the buttons are held, or free, and what was seen in it, oldest first.

    ``lost``: the s for which processes of the swarm waited for a CPU, up to the last look at late motion.
    """

    held: bool
    began: float
    looks: list[Look] = field(default_factory=list)
    lost: float = 0.0

    def saw(self, look: Look, queue: RunQueue) -> None:
        """Adds a look. ``queue`` counts since the stretch began."""
        self.looks.append(look)
        if not self.held and look.moving and look.moment - self.began > STILL:
            self.lost = queue.lost()

    def until(self, robot: str, *, moving: bool) -> float | None:
        """The s until the robot was first seen to move, or to stand; None if it never was."""
        found = (one.moment - self.began for one in self.looks if (robot in one.moving) is moving)
        return next(found, None)

    def share(self, robot: str) -> float:
        """The share of the looks at which it moved."""
        return fmean(robot in one.moving for one in self.looks)

    def pauses(self, robot: str) -> int:
        """How often it stopped after it had begun to move."""
        seen = [robot in one.moving for one in self.looks]
        return sum(before and not after for before, after in pairwise(seen))

    def late(self, robot: str) -> float:
        """For how long it moved after it should have stood, s."""
        moved = [one.moment - self.began for one in self.looks if robot in one.moving]
        return max(0.0, max(moved, default=0.0) - STILL)

    def crept(self, robot: str) -> float:
        """How far it came after it had stood at last, m: motion between two looks."""
        still = [one.ways[robot] for one in self.looks if one.moment - self.began > STILL]
        moved = [robot in one.moving for one in self.looks if one.moment - self.began > STILL]
        return 0.0 if not still or any(moved) else still[-1] - still[0]
