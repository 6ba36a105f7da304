"""Drivers on ROS 1 beside ROS 2: ``python benchmarks/ros2.py [--seconds S] [--check]``, as root.

One leader drives a Koala, a Khepera III and an e-puck in the lab, with each distribution in turn: the time
from a command to the last wheel, CPU and memory of each driver.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from leader import HOST, SPEEDS, Cost, Leader, booted, costs, latency, move

from swarmctl.lab import paths
from swarmctl.lab.hosts import image
from swarmctl.swarm.names import robot_namespace
from tests.loading import load_swarm

DISTROS = ("noetic", "jazzy", "kilted")
CHANGES = 20  # of speed
SLOWER, MEMORY = 1.5, 90.0  # bars: latency as a multiple of that of ROS 1, MB of a driver
SPEC = """\
version: 1
name: bench
mode: single-minded
leader: {host}
ros: {{distro: {distro}}}
hosts: {{{host}: {{address: 10.77.0.10, bluetooth: [hci0]}}}}
robots: {{koala: {{type: koala}}, k3: {{type: khepera3}}, epuck: {{type: epuck}}}}
links:
  - {{kind: serial, host: {host}, robot: koala, usb: {{serial: KOALA1}}}}
  - {{kind: serial, host: {host}, robot: k3, usb: {{serial: FTDI1}}}}
  - {{kind: bluetooth, host: {host}, robot: epuck, mac: "10:00:e8:c5:64:37"}}
programs:
  drive: {{host: {host}, package: drive, executable: drive, lifecycle: interactive, optional: true}}
control: [{{by: drive, of: [koala, k3, epuck]}}]
"""


@dataclass(frozen=True)
class Measured:
    """Each driver's cost, and the s from each command until the last robot obeys."""

    drivers: Mapping[str, Cost]
    last: tuple[float, ...]


def measured(folder: Path, distro: str, seconds: float) -> Measured:
    spec = folder / f"{distro}.yaml"
    spec.write_text(SPEC.format(host=HOST, distro=distro))
    swarm, diagnostics = load_swarm(spec)
    if swarm is None:
        raise SystemExit(f"the benchmark's own spec is wrong: {diagnostics}")
    image.ensure(lambda line: print(f"  image: {line}", file=sys.stderr), distro=distro)
    speeds = [f"{robot_namespace(name, None)}={SPEEDS[one.type_name]}" for name, one in swarm.robots.items()]
    with booted(swarm) as name:
        leader = Leader(swarm, name)
        with leader.running("drive.py", *speeds) as drive:
            move(drive, 1.0)
            leader.awaits(lambda seen: all(seen.values()), "not every robot moves")
            time.sleep(5.0)  # until all is imported and connected
            drivers = costs(leader.drivers(), seconds)
            last = tuple(latency(leader, drive, bool(turn % 2))[1] for turn in range(CHANGES))
    return Measured(drivers, last)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=15.0, help="how long CPU is measured")
    parser.add_argument("--check", action="store_true", help="exit 1 when a bar is missed")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="swarm-bench-"))
    os.environ[paths.STATE_VARIABLE] = str(folder)
    try:
        found = {distro: measured(folder, distro, given.seconds) for distro in DISTROS}
    finally:
        shutil.rmtree(folder)
    print(f"{'':8}{'robot':8}{'CPU %':>8}{'RSS MB':>8}{'command to the last wheel, ms':>31}{'highest':>9}")
    for distro, one in found.items():
        for robot, cost in one.drivers.items():
            print(f"{distro:8}{robot:8}{cost.cpu:8.2f}{cost.resident:8.1f}")
        print(f"{distro:8}{'all':8}{'':16}{1000 * median(one.last):31.1f}{1000 * max(one.last):9.1f}")
    bars: dict[str, bool] = {}
    first, *others = DISTROS
    for distro in others:
        ratio = median(found[distro].last) / median(found[first].last)
        memory = max(cost.resident for cost in found[distro].drivers.values())
        bars[f"{distro}: latency {ratio:.2f} <= {SLOWER:g} x that of {first}"] = ratio <= SLOWER
        bars[f"{distro}: RSS of a driver {memory:.1f} <= {MEMORY:g} MB"] = memory <= MEMORY
    for bar, kept in bars.items():
        print(f"{'PASS' if kept else 'FAIL'}: {bar}")
    return int(given.check and not all(bars.values()))


if __name__ == "__main__":
    sys.exit(main())
