"""What the gate in front of a vendor's driver costs: ``python benchmarks/gate.py [--commands N]``, as root.

Real rospy in the lab's image: a publisher, the gate, a subscriber; in the same run and in turns the publisher
and a subscriber without a gate. Exits with 1 if a bar is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median, quantiles
from typing import Any

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from tests import ROOT
from tests.onboard.gate.ros_host import Node, RosHost, run_isolated, wait_until

ADDED, RESIDENT = 2.0, 40.0  # bars: ms of the median, MB
CPU = 5.0  # % of one core at 20 commands a second
OUTPUT, DIRECT = "/tb/gate/cmd_vel", "/direct"
TICKS = os.sysconf("SC_CLK_TCK")
INSIDE = "--inside"


def measured(disk: Path, commands: int) -> dict[str, Any]:
    """The figures, from inside the namespaces of the host."""
    from tests.onboard.gate.faults import COMMAND, NAMESPACE, PARAMETERS

    host = RosHost(disk, PARAMETERS, ROOT / "tests/onboard/gate/nodes")
    gate = host.gate()
    robots = {
        COMMAND: host.node("robot.py", NAMESPACE, OUTPUT),
        DIRECT: host.node("robot.py", "/bare", DIRECT),
    }
    pulses = host.node("pulses.py", "/boss", commands, COMMAND, DIRECT)
    wait_until(lambda: pulses.lines, "the first command")
    pid, began = gate_pid(gate), time.monotonic()
    cpu = seconds_of(pid)
    pulses.process.wait()
    took, cpu = time.monotonic() - began, seconds_of(pid) - cpu
    time.sleep(0.5)
    latencies = {topic: sorted(trips(pulses, robot, topic)) for topic, robot in robots.items()}
    return {
        "gate": latencies[COMMAND],
        "direct": latencies[DIRECT],
        "cpu": 100 * cpu / took,
        "resident": resident(pid),
    }


def trips(pulses: Node, robot: Node, topic: str) -> list[float]:
    """The ms from the publisher to the subscriber, of each command that arrived; repetitions do not count."""
    arrived: dict[int, float] = {}
    for line in robot.lines:
        if "v" in line and line["v"][0]:
            arrived.setdefault(round(line["v"][0] * 1e6), line["t"])
    sent = {line["n"]: line["t"] for line in pulses.lines if line["topic"] == topic}
    return [1000 * (moment - sent[number]) for number, moment in arrived.items()]


def gate_pid(gate: Node) -> int:
    """chroot replaces itself by the program."""
    return gate.process.pid


def seconds_of(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def resident(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmRSS"))


def shown(found: dict[str, Any], commands: int) -> bool:
    """Print the figures; whether every bar is kept."""
    for name in ("direct", "gate"):
        trip = found[name]
        print(
            f"{name:8} median {median(trip):6.2f} ms   95 % {quantiles(trip, n=20)[-1]:6.2f} ms   "
            f"highest {trip[-1]:6.2f} ms   {len(trip)} of {commands} commands"
        )
    added = median(found["gate"]) - median(found["direct"])
    bars = {
        f"latency that the gate adds, median: {added:.2f} <= {ADDED:g} ms": added <= ADDED,
        f"resident memory: {found['resident']:.1f} <= {RESIDENT:g} MB": found["resident"] <= RESIDENT,
        f"CPU at 20 commands a second: {found['cpu']:.1f} <= {CPU:g} % of one core": found["cpu"] <= CPU,
    }
    for bar, kept in bars.items():
        print(f"{'PASS' if kept else 'FAIL'}: {bar}")
    return all(bars.values())


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commands", type=int, default=400, help="commands on each way, 20 a second")
    parser.add_argument(INSIDE, type=Path, metavar="IMAGE", help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.inside is not None:
        print(json.dumps(measured(given.inside, given.commands)))
        return 0
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
    except LabError as error:
        print(error, file=sys.stderr)
        return 1
    disk = image.ensure(lambda line: print(f"  image: {line}", file=sys.stderr))
    found = run_isolated(Path(__file__).resolve(), INSIDE, disk, "--commands", given.commands)
    return int(not shown(found, given.commands))


if __name__ == "__main__":
    sys.exit(main())
