"""Waits, and bounds of work: nothing here can fail because a machine is slow or busy.

What has to happen at some time gets `PATIENCE`; a long limit costs nothing when the test passes. What never
ends is ended by pytest's own limit for each test (pyproject.toml). Computing is bounded in runs of a
reference workload, measured in the same process at the same moment (`work_at_most`). A time that swarmctl
promises goes through the fixture `promise` (conftest.py), less what `RunQueue` or `withheld` measured that
the machine kept processes from running: `make bench` compares it with its bar.
"""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

import yaml

from swarmctl.rulebook import rulebook

Found = TypeVar("Found")
Promise = Callable[[str, float, float], None]  # the fixture's type: what, its seconds, its bar in s

#: Seconds until a test gives up waiting for what has to happen.
PATIENCE = 60.0

#: % of the time in which some process waits for a CPU, above which no lab starts.
FULL = 90.0

#: How many times more work than measured a bound allows, at the least.
MARGIN = 5.0

_TEXT = "\n".join(
    f"robot-{number}: {{type: koala, host: pi-{number}, at: [{number}, 2.5]}}" for number in range(30)
)


def wait_for(
    what: Callable[[], Found], seconds: float = PATIENCE, complaint: str = "", interval: float = 0.005
) -> Found:
    """Return the first true value of ``what``; fail with ``complaint`` if there is none in ``seconds``."""
    end = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < end, complaint or f"it did not happen within {seconds:g} s"
        time.sleep(interval)
    return found


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
    return stolen + _cpu_pressure().get("total", 0.0) / 1e6


def wait_for_cpu() -> None:
    """Wait, ten minutes at most, while some process waits for a CPU nearly all the time.

    A lab that starts then starves those that run: their nodes and probes come too late.
    """
    end = time.monotonic() + 10 * PATIENCE
    while _cpu_pressure().get("avg10", 0.0) > FULL and time.monotonic() < end:
        time.sleep(random.uniform(5, 15))  # of several that wait, one comes first


def _cpu_pressure() -> dict[str, float]:
    """Return the averages, in % of the time, and the total, in us, of "some" (kernel: accounting/psi.rst)."""
    try:
        some = Path("/proc/pressure/cpu").read_text().split("\n", 1)[0]
    except OSError:
        return {}
    return {name: float(value) for name, _, value in (part.partition("=") for part in some.split()[1:])}


def reference() -> float:
    """Return the CPU seconds that the reference workload takes now: PyYAML reads 30 lines."""
    began = time.process_time()
    yaml.compose(_TEXT, yaml.SafeLoader)
    return time.process_time() - began


@contextmanager
def work_at_most(references: float) -> Iterator[None]:
    """Fail if the block takes more CPU time of this process than ``references`` runs of the `reference`.

    Choose at least `MARGIN` times what the failure of a slower run prints.
    """
    rulebook()  # read once, for the first finding
    began = time.process_time()
    yield
    took = (time.process_time() - began) / reference()
    assert took <= references, f"{took:.1f} times the reference workload instead of {references:g}"
