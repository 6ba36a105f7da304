"""Waits and bounds of time for tests, such that a busy machine makes none of them fail.

What has to happen at some time gets `PATIENCE`; a long limit costs nothing when the test passes. A bound
that was chosen for a quiet machine goes through `at_most`, which scales it by a calibration of this moment.
A bound that a promise states is never scaled: `RunQueue` measures how long the machine kept the processes
concerned from running in the same window, and only that is added; `withheld` measures the same of all
processes, where those concerned are unknown or have ended. Pure computation is measured in CPU time
(`cpu_at_most`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

Found = TypeVar("Found")

#: Seconds until a test gives up waiting for what has to happen.
PATIENCE = 60.0

#: For CPU seconds of small processes beside other tests: what shares caches and cores slows them down, up to
#: 1.5 times where that was measured. The bars themselves are those of `make bench`, on a quiet machine.
CPU_MARGIN = 2.0

_ROUNDS = 400_000
_QUIET_S = 0.02  # what the fixed work takes on the quiet 2-core machine for which bounds were chosen
_worst = 1.0


def wait_for(
    what: Callable[[], Found], seconds: float = PATIENCE, complaint: str = "", interval: float = 0.005
) -> Found:
    """Return the first true value of ``what``; fail with ``complaint`` if there is none in ``seconds``."""
    end = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < end, complaint or f"it did not happen within {seconds:g} s"
        time.sleep(interval)
    return found


def at_most(seconds: float) -> float:
    """Return ``seconds`` times the `slowness` of the machine: the worst of now and earlier in this run."""
    global _worst  # noqa: PLW0603
    _worst = max(_worst, *(slowness() for _ in range(3)))
    return seconds * _worst


def slowness() -> float:
    """Return how many times longer than on a quiet machine a fixed piece of work takes now; never below 1."""
    began = time.monotonic()
    number = 0
    for summand in range(_ROUNDS):
        number += summand
    return max(1.0, (time.monotonic() - began) / _QUIET_S)


class RunQueue:
    """Measures how long threads were ready to run and did not get a CPU, from now on.

    The threads are those of this process and of the processes ``pids``. Their sum is at least the delay that
    the machine added to any chain of events among them. A process that has ended counts no more.
    """

    def __init__(self, *pids: int) -> None:
        self._pids = (os.getpid(), *pids)
        self._before = self._delays()

    def lost(self) -> float:
        """Return the seconds lost since the start."""
        now = self._delays()
        return sum(max(0.0, delay - self._before.get(thread, 0.0)) for thread, delay in now.items())

    def _delays(self) -> dict[str, float]:
        """Return the run-queue delay of each thread, in s (kernel: scheduler/sched-stats.rst)."""
        delays: dict[str, float] = {}
        for pid in self._pids:
            for file in Path(f"/proc/{pid}/task").glob("*/schedstat"):
                with suppress(OSError, IndexError):
                    delays[str(file)] = int(file.read_text().split()[1]) / 1e9
        return delays


def withheld() -> float:
    """Return the seconds since boot in which some process waited for a CPU, or the hypervisor had one.

    Its growth in a window is at least the delay that the machine added to any chain of events in it (kernel:
    accounting/psi.rst, filesystems/proc.rst). A kernel without the first counts the second alone.
    """
    stolen = int(Path("/proc/stat").read_text().split("\n", 1)[0].split()[8]) / os.sysconf("SC_CLK_TCK")
    try:
        some = Path("/proc/pressure/cpu").read_text().split("\n", 1)[0]
    except OSError:
        return stolen
    return stolen + int(some.rpartition("total=")[2]) / 1e6


@contextmanager
def cpu_at_most(seconds: float) -> Iterator[None]:
    """Fail if the block takes longer, in CPU seconds of this process, which other processes do not affect."""
    began = time.process_time()
    yield
    took = time.process_time() - began
    assert took < seconds, f"{took:.2f} s of CPU time instead of {seconds:g} s"
