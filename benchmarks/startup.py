"""CPU time of ``swarmctl`` for showing help, as a ratio to a bare Python: ``python benchmarks/startup.py``.

Whole processes in turn; the minimum of several runs each, because other processes only add to a time.
Exits with 1 if a ratio is over the bar.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

BAR = 9.0  # times the CPU time of a bare Python
PROGRAM = str(Path(sys.executable).with_name("swarmctl"))
BARE = "python -I -c pass"


class Cost(NamedTuple):
    """Of one process, in seconds."""

    cpu: float
    wall: float


def commands(verbs: Sequence[str]) -> dict[str, list[str]]:
    """What is measured, by the name it has in the table."""
    words = [["--version"], ["--help"], *([verb, "--help"] for verb in verbs)]
    return {
        BARE: [sys.executable, "-I", "-c", "pass"],
        "python -m swarmctl --help": [sys.executable, "-m", "swarmctl", "--help"],
    } | {" ".join(["swarmctl", *each]): [PROGRAM, *each] for each in words}


def cost(command: list[str]) -> Cost:
    """Of one run, with the compiled modules of the run before in the cache."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Cost(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall)


def measured(commands: Mapping[str, list[str]], runs: int) -> dict[str, Cost]:
    """The minima of all runs but the first, which may compile modules; the commands take turns."""
    rounds = [{name: cost(command) for name, command in commands.items()} for _ in range(runs + 1)][1:]
    return {
        name: Cost(min(one[name].cpu for one in rounds), min(one[name].wall for one in rounds))
        for name in commands
    }


def main(arguments: Sequence[str] | None = None) -> int:
    from swarmctl.cli.app import Verbs

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10, help="runs of each command")
    parser.add_argument("--bar", type=float, default=BAR, help=f"the largest ratio that passes ({BAR})")
    parser.add_argument(
        "verbs", nargs="*", metavar="VERB", help="measure the help of these verbs; all, without"
    )
    given = parser.parse_args(arguments)
    costs = measured(commands(given.verbs or [verb.name for verb in Verbs.verbs]), given.runs)
    ratios = {name: one.cpu / costs[BARE].cpu for name, one in costs.items()}
    width = max(map(len, costs))
    print(f"{'':{width}}  CPU time    wall   ratio   (s, minimum of {given.runs} runs; bar {given.bar:g})")
    for name, one in costs.items():
        over = "  over the bar" if ratios[name] > given.bar else ""
        print(f"{name:{width}}  {one.cpu:8.3f}  {one.wall:6.3f}  {ratios[name]:5.1f}x{over}")
    return int(max(ratios.values()) > given.bar)


if __name__ == "__main__":
    sys.exit(main())
