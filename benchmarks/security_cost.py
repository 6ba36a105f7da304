"""What each level of `security` costs: ``python benchmarks/security_cost.py [--rounds N] [--seconds S]``.

As root, three hosts in the lab, the levels in turns: the time from a command to the wheels,
that of a registration at the master from another host with its CPU time there, and CPU as all drive.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median, quantiles

from leader import usage

from swarmctl.lab import paths
from swarmctl.lab.hosts import network, processes
from tests import ROOT
from tests.child_process import child_process
from tests.e2e.lab_swarm import LEADER, SOURCE, SWARM, LabSwarm, lab_of, moves, quoted, until

EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"
LEVELS = ("off", "filtered", "sealed")
SPEEDS = {"koala": 0.2, "k3": 0.1, "epuck": 0.05}  # m/s
CALLER = "k3-pi"
CALLS = 400  # registrations at the master
STARTS = 10  # of all robots
ONHOST = Path(__file__).parent / "onhost"


@dataclass
class Found:
    """ms from a command to a wheel of each robot, ms of registrations; of each round, ms of the master's CPU
    for a registration, and % of one core while all drive."""

    wheels: list[float] = field(default_factory=list)
    registrations: list[float] = field(default_factory=list)
    work: list[float] = field(default_factory=list)
    master: list[float] = field(default_factory=list)
    hosts: list[float] = field(default_factory=list)


def program(script: str, *arguments: object) -> str:
    """A script of ``onhost`` under the swarm's ROS."""
    text = (ONHOST / script).read_text("utf-8")
    return f"{SOURCE}; exec python3 -uc {quoted(text)} {' '.join(map(str, arguments))}"


def measure(swarm: LabSwarm, found: Found, seconds: float) -> None:
    """One round, of the level that is deployed."""
    place = paths.lab_paths(swarm.name)
    speeds = (f"/{robot}={speed}" for robot, speed in SPEEDS.items())
    argv = swarm.shell_argv(LEADER, program("drive.py", *speeds))
    with child_process(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as drive:
        obeyed(swarm, drive, True)
        time.sleep(3)  # until all is connected
        spaces = [network.namespace_path(place, host) for host in swarm.hosts]
        hosts = processes.in_network_namespaces(spaces)
        master = [pid for pid in hosts if is_of_master(pid)]
        before, began = (used(master), used(hosts)), time.monotonic()
        time.sleep(seconds)
        took = time.monotonic() - began
        found.master.append(100 * since(before[0]) / took)
        found.hosts.append(100 * since(before[1]) / took)
        for _ in range(STARTS):
            obeyed(swarm, drive, False)
            time.sleep(0.5)
            found.wheels += obeyed(swarm, drive, True)
            time.sleep(0.5)
        assert drive.stdin is not None
        drive.stdin.close()
        drive.wait(10)
    earlier = used(master)
    found.registrations += json.loads(swarm.shell(CALLER, program("register.py", CALLS)))
    found.work.append(1000 * since(earlier) / CALLS)


def obeyed(swarm: LabSwarm, drive: subprocess.Popen[str], go: bool) -> list[float]:
    """The ms from a command to all robots until each moves, or stands."""
    assert drive.stdin is not None
    assert drive.stdout is not None
    drive.stdin.write(f"{float(go)}\n")
    drive.stdin.flush()
    commanded = float(drive.stdout.readline())
    seen: dict[str, float] = {}

    def all_obey() -> bool:
        for name, state in swarm.robots().items():
            if moves(state) == go:
                seen.setdefault(name, 1000 * (time.monotonic() - commanded))
        return seen.keys() == SPEEDS.keys()

    until(all_obey, "a robot does not obey")
    return list(seen.values())


def used(pids: Iterable[int]) -> dict[int, float]:
    """The s of CPU that processes have used, without those that have ended."""
    return {pid: usage(pid).cpu for pid in pids if Path(f"/proc/{pid}/stat").exists()}


def since(earlier: Mapping[int, float]) -> float:
    """The s of CPU that processes have used since ``earlier``."""
    return sum(now - earlier[pid] for pid, now in used(earlier).items())


def is_of_master(pid: int) -> bool:
    return f"/swarm-{SWARM}.master.service\n" in Path(f"/proc/{pid}/cgroup").read_text()


def measured(folder: Path, rounds: int, seconds: float) -> dict[str, Found]:
    """The figures by level; the levels take turns."""
    found = {level: Found() for level in LEVELS}
    with lab_of(f"security-{os.getpid()}", EXAMPLE, folder) as swarm:
        specs = {
            level: swarm.variant(level, ("mode: leader", f"security: {level}\nmode: leader"))
            for level in LEVELS
        }
        pinned = swarm.swarmctl("trust", spec=specs["sealed"])
        if pinned.status:
            raise SystemExit(f"no keys of WireGuard: {pinned.out}{pinned.err}")
        for _ in range(rounds):
            for level, spec in specs.items():
                run = swarm.deploy(spec)
                if run.status:
                    raise SystemExit(f"the deploy of {level} failed: {run.out}{run.err}")
                measure(swarm, found[level], seconds)
    return found


def shown(found: dict[str, Found]) -> None:
    print(f"{'':44}" + "".join(f"{level:>10}" for level in LEVELS))
    rows = {
        "command to a wheel, median, ms": [median(one.wheels) for one in found.values()],
        "command to a wheel, 95 %, ms": [quantiles(one.wheels, n=20)[-1] for one in found.values()],
        "registration at the master, median, ms": [median(one.registrations) for one in found.values()],
        "registration at the master, 95 %, ms": [
            quantiles(one.registrations, n=20)[-1] for one in found.values()
        ],
        "its CPU in the unit of the master, ms": [median(one.work) for one in found.values()],
        "unit of the master, all drive, % of a core": [median(one.master) for one in found.values()],
        "all hosts, all drive, % of a core": [median(one.hosts) for one in found.values()],
    }
    for name, values in rows.items():
        print(f"{name:44}" + "".join(f"{value:10.2f}" for value in values))


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=10.0, help="how long CPU is measured")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as folder:
        os.environ[paths.STATE_VARIABLE] = folder
        shown(measured(Path(folder), given.rounds, given.seconds))
    return 0


if __name__ == "__main__":
    sys.exit(main())
