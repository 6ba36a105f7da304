"""CPU time of `swarmctl plan --offline`: ``python benchmarks/plan.py [--robots N ...]``; exit 1 above a bar.

Whole processes, on the specs of benchmarks/validate.py; nothing was deployed before, so that every file of
every host is in the plan. The table has the time of ``yaml.compose`` on the same text beside it, because
seconds differ from machine to machine.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
from pathlib import Path

from validate import PROGRAM, SIZES, spec_of, times, whole

BAR = 8.0  # s, for 10 000 robots
EXPONENT = 1.15  # of the growth of the time with the robots, without the time of `START` robots
START = 60  # two islands
MODES = ("leader", "combined")


def cost(file: Path, runs: int) -> tuple[float, float]:
    """CPU time and memory of the cheapest of some runs."""
    return min(whole([PROGRAM, "plan", "--offline", str(file)]) for _ in range(runs))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--robots", type=int, nargs="+", default=SIZES, help="other sizes")
    parser.add_argument("--runs", type=int, default=2, help="runs of each; the least time counts")
    given = parser.parse_args()
    print(f"{'':10}{'robots':>7}{'compose s':>11}{'plan s':>8}{'ratio':>7}{'MB':>6}")
    slowest, steepest = 0.0, 0.0
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as folder:
        os.environ["XDG_STATE_HOME"] = folder  # no deploy from this machine counts
        for mode in MODES:
            seconds = {}
            for robots in (START, *given.robots):
                file = Path(folder, f"{mode}-{robots}.yaml")
                file.write_text(spec_of(mode, robots), "utf-8")
                compose, _ = times(file, given.runs)
                seconds[robots], megabytes = cost(file, given.runs)
                ratio = seconds[robots] / compose
                print(f"{mode:10}{robots:7}{compose:11.3f}{seconds[robots]:8.2f}{ratio:7.1f}{megabytes:6.0f}",
                      flush=True)  # fmt: skip
            start, *grown = seconds.values()
            slowest = max(slowest, grown[-1] * SIZES[-1] / given.robots[-1])
            if len(grown) > 1:
                growth = (grown[-1] - start) / (grown[-2] - start)
                steepest = max(steepest, math.log(growth, given.robots[-1] / given.robots[-2]))
    kept = slowest <= BAR and steepest <= EXPONENT
    print(f"{'PASS' if kept else 'FAIL'}: {slowest:.1f} s for {SIZES[-1]} robots (bar {BAR:g}),"
          f" growth: time ~ robots^{steepest:.2f} (bar {EXPONENT:g})")  # fmt: skip
    return int(not kept)


if __name__ == "__main__":
    sys.exit(main())
