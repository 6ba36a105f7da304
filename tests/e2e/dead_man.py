"""How robots truly move around a fault, who commands them, and the page that promises how soon they stand."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import pairwise, takewhile

from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import network, processes
from tests import ROOT
from tests.e2e.lab_swarm import SOURCE, LabSwarm, moves, namespace_of, quoted
from tests.timing import wait_for, withheld

DRIVE = (ROOT / "benchmarks/onhost/drive.py").read_text("utf-8")
ANSWERS = 20.0  # s
ROS_1, ROS_2 = "ROS 1", "ROS 2"


@dataclass(frozen=True)
class Look:
    """All robots at one moment: which move, how far each has come (m), what the machine has withheld (s)."""

    at: float
    withheld: float
    moving: Mapping[str, bool]
    way: Mapping[str, float]


@dataclass(frozen=True)
class Stop:
    """How a robot came to stand after a fault: seconds, and metres that it still drove.

    ``withheld``: seconds of these in which the machine let some process wait for a CPU.
    """

    seconds: float
    metres: float
    withheld: float = 0.0


class Watch:
    """Looks at the robots all the time, as often as the lab answers."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._looks: list[Look] = []
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._look)

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()

    def _look(self) -> None:
        while not self._done.wait(0.002):
            states = lab.robots(self._name)
            self._looks.append(
                Look(
                    time.monotonic(),
                    withheld(),
                    {name: moves(state) for name, state in states.items()},
                    {name: state["distance"] for name, state in states.items()},
                )
            )

    def stops(self, fault: float) -> dict[str, Stop]:
        """How each robot came to stand after the moment ``fault``."""
        found: dict[str, Stop] = {}
        seen = 0

        def all_stand() -> bool:
            nonlocal seen
            looks, seen = self._looks[seen:], len(self._looks)
            for look in looks:
                for robot, moving in look.moving.items():
                    if look.at > fault and not moving and robot not in found:
                        before = self.before(fault)
                        metres, waited = look.way[robot] - before.way[robot], look.withheld - before.withheld
                        found[robot] = Stop(look.at - fault, metres, waited)
            return bool(looks) and len(found) == len(looks[-1].moving)

        wait_for(all_stand, complaint="not all robots stand", interval=0.01)
        return found

    def before(self, moment: float) -> Look:
        return next(look for look in reversed(self._looks) if look.at <= moment)

    def moved(self, begin: float, end: float) -> dict[str, Stop]:
        """For how long at most, and how far, each robot moved in between."""
        looks = [look for look in self._looks if begin <= look.at <= end]
        return {robot: _moved(looks, robot) for robot in looks[0].moving}

    def rate(self, since: float) -> float:
        """Looks a second."""
        looks = [look.at for look in self._looks if look.at >= since]
        return (len(looks) - 1) / (looks[-1] - looks[0])


def _moved(looks: Sequence[Look], robot: str) -> Stop:
    """One that moves at one of two looks counts as moving from the first to the second."""
    pairs = [
        (before, after) for before, after in pairwise(looks) if before.moving[robot] or after.moving[robot]
    ]
    return Stop(
        sum(after.at - before.at for before, after in pairs),
        looks[-1].way[robot] - looks[0].way[robot],
        sum(after.withheld - before.withheld for before, after in pairs),
    )


class Commander:
    """A node that publishes commands to all robots, ten times a second. ``end`` it, or use ``commanding``."""

    def __init__(self, swarm: LabSwarm, host: str, speeds: Mapping[str, float], name: str) -> None:
        self._swarm = swarm
        self._host = host
        self._name = f"__name:={name}"
        words = [*(f"/{robot}={speed}" for robot, speed in speeds.items()), self._name]
        command = f"{SOURCE}; exec python3 -uc {quoted(DRIVE)} {' '.join(words)}"
        # A connection of its own: others must not wait for one that is cut.
        ssh = lab.ssh_argv(swarm.name, host, [f"bash -c {quoted(command)}"])
        argv = ["nsenter", f"--net={namespace_of(swarm)}", *ssh]
        pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
        self._process = subprocess.Popen(argv, stdin=pipe, stdout=pipe, stderr=nothing, text=True)

    def command(self, factor: float) -> float:
        """Commands this from now on; returns the moment of its first publication."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{factor}\n")
        self._process.stdin.flush()
        readable, _, _ = select.select([self._process.stdout], [], [], ANSWERS)
        assert readable, f"the commander on {self._host} prints nothing"
        return float(self._process.stdout.readline())

    def send(self, number: int) -> float:
        """Send the node a signal; the moment before it."""
        return signalled(self._swarm, self._host, number, self._name)

    def end(self) -> None:
        with suppress(AssertionError):
            self.send(signal.SIGKILL)
        self._process.kill()
        with suppress(BrokenPipeError):
            self._process.communicate()


@contextmanager
def commanding(
    swarm: LabSwarm, host: str, speeds: Mapping[str, float], name: str = "drive"
) -> Iterator[Commander]:
    commander = Commander(swarm, host, speeds, name)
    try:
        yield commander
    finally:
        commander.end()


def running(swarm: LabSwarm, host: str, *arguments: str) -> list[int]:
    """The processes on a host that were started with ``arguments``, by the ids that they have here."""
    inside = network.namespace_path(paths.lab_paths(swarm.name), host)
    return sorted({*processes.with_arguments(*arguments)} & {*processes.in_network_namespaces([inside])})


def signalled(swarm: LabSwarm, host: str, number: int, *arguments: str) -> float:
    """Send a signal to who was started with ``arguments``; the moment before it."""
    pids = running(swarm, host, *arguments)
    assert pids, f"nobody on {host} runs with {arguments}"
    moment = time.monotonic()
    for pid in pids:
        os.kill(pid, number)
    return moment


def from_within(swarm: LabSwarm, host: str, command: str) -> float:
    """Run ``command`` on a host; the moment before it, by the host's own clock."""
    ahead = time.clock_gettime(time.CLOCK_BOOTTIME) - time.monotonic()
    with suppress(subprocess.TimeoutExpired):
        return float(swarm.shell(host, f"cut -d' ' -f1 /proc/uptime; {command}", timeout=10)) - ahead
    raise AssertionError(f"{host}: `{command}` does not end")


class Page:
    """The table in docs/dead-man.md: a fault, a figure for each robot, the bound, and why it holds."""

    PATH = ROOT / "docs/dead-man.md"

    def __init__(self, ros: str = ROS_1) -> None:
        self._lines = self.PATH.read_text("utf-8").splitlines()
        head = f"| fault, {ros} |"
        first = next(number for number, line in enumerate(self._lines) if line.startswith(head))
        self._robots = [cell.split(",")[0] for cell in _cells(self._lines[first])[1:-2]]
        self._rows = {
            _cells(line)[0]: number
            for number, line in enumerate(
                takewhile(lambda line: line.startswith("|"), self._lines[first + 2 :]), first + 2
            )
        }

    @property
    def faults(self) -> tuple[str, ...]:
        return tuple(self._rows)

    def bound(self, fault: str) -> float:
        """Seconds within which robots stand."""
        return float(_cells(self._lines[self._rows[fault]])[-2].removeprefix("≤ ").removesuffix(" s"))

    def stops(self, fault: str) -> dict[str, Stop]:
        """What the page says of the run that was written down."""
        cells = _cells(self._lines[self._rows[fault]])[1:-2]
        figures = [[float(word.split()[0]) for word in cell.split(",")] for cell in cells]
        return {robot: Stop(*figure) for robot, figure in zip(self._robots, figures, strict=True)}

    def write(self, fault: str, stops: Mapping[str, Stop]) -> None:
        name, *_, bound, why = _cells(self._lines[self._rows[fault]])
        figures = [f"{stops[robot].seconds:.2f} s, {stops[robot].metres:.3f} m" for robot in self._robots]
        self._lines[self._rows[fault]] = "| " + " | ".join([name, *figures, bound, why]) + " |"
        self.PATH.write_text("\n".join(self._lines) + "\n", "utf-8")


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip("|").split("|")]
