"""What a lab costs: ``python benchmarks/lab.py [--hosts N] [--rounds N] [--check]``, as root.

Seconds of every step of ``lab up`` and of ``lab down``, the image cached.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import image
from swarmctl.lab.lab_plan import Interface, LabHost, LabNetwork, LabPlan

BAR = 8.0  # s for ``up`` of three hosts
BOOT = "hosts boot and answer SSH"
Round = dict[str, float]


def plan_of(hosts: int) -> LabPlan:
    """Hosts on one network."""
    return LabPlan(
        f"bench-{os.getpid()}",
        "bench",
        tuple(
            LabHost(f"h{number}", address, "robot", 22, (Interface("wlan0", "air", f"{address}/16"),))
            for number in range(hosts)
            for address in [f"10.77.{number // 200}.{number % 200 + 10}"]
        ),
        (LabNetwork("air", "wlan", "10.77.0.0/16", "10.77.255.254/16", True),),
        (),
    )


def measured(plan: LabPlan) -> Round:
    """One ``up``, step by step, and one ``down``."""
    steps: Round = {}
    began = last = time.perf_counter()

    def step(line: str) -> None:
        nonlocal last
        now = time.perf_counter()
        title = BOOT if line.startswith("host ") else line.partition(":")[0]
        steps[title] = steps.get(title, 0.0) + now - last
        last = now

    try:
        lab.up(plan, step)
        steps["up"] = time.perf_counter() - began
    finally:
        began = time.perf_counter()
        lab.down(plan.name)
        steps["down"] = time.perf_counter() - began
    return steps


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hosts", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--check", action="store_true", help=f"exit 1 when three hosts take longer than {BAR} s"
    )
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="swarm-bench-"))
    os.environ[paths.STATE_VARIABLE] = str(folder)
    try:
        image.ensure(lambda line: print(f"  image: {line}", file=sys.stderr))
        rounds = [measured(plan_of(given.hosts)) for _ in range(given.rounds)]
    finally:
        shutil.rmtree(folder)
    print(f"{f'{given.hosts} hosts, {given.rounds} rounds':28}{'median s':>10}{'lowest':>8}{'highest':>9}")
    for step in rounds[0]:
        seconds = [one[step] for one in rounds]
        bar = f"  <= {BAR:g}" if step == "up" and given.hosts == 3 else ""
        print(f"{step:28}{statistics.median(seconds):10.2f}{min(seconds):8.2f}{max(seconds):9.2f}{bar}")
    slow = given.hosts == 3 and statistics.median(one["up"] for one in rounds) > BAR
    return int(slow and given.check)


if __name__ == "__main__":
    sys.exit(main())
