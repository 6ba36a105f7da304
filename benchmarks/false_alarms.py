"""How often `status` calls a healthy swarm unhealthy: ``python benchmarks/false_alarms.py [--looks N]``.

As root. A lab of ROS 2: two TurtleBot 4 behind gates, which a gamepad drives, on four hosts. N looks while
the machine does nothing else, and N beside four busy processes; prints the findings of each that is not
healthy.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from typing import IO

from swarmctl.lab import lab, paths
from tests import ROOT
from tests.e2e.lab_swarm import SOURCE, LabSwarm, lab_of, moves, namespace_of, quoted, until

DESK, ROBOTS = "desk", ("tb4-1", "tb4-2")
BUSY = 4  # processes
SPEC = ROOT / "tests/faults-of-ros2.swarm.yaml"


@contextmanager
def driven(swarm: LabSwarm) -> Iterator[None]:
    """A gamepad whose stick is pushed; entered once all robots drive."""
    gamepad = quoted((ROOT / "examples/gamepad.py").read_text("utf-8"))
    ssh = lab.ssh_argv(swarm.name, DESK, [f"bash -c {quoted(f'{SOURCE}; exec python3 -uc {gamepad}')}"])
    argv = ["nsenter", f"--net={namespace_of(swarm)}", *ssh]
    with subprocess.Popen(argv, stdin=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        try:
            until(lambda: _drive(swarm, process.stdin), "not all robots drive")
            yield
        finally:
            process.stdin.close()


def _drive(swarm: LabSwarm, stick: IO[str]) -> bool:
    """Lets go of the dead-man button, which was held before the joystick's program ran, and drives."""
    for line in ("free", "0.5 0.2"):
        stick.write(f"{line}\n")
        stick.flush()
        time.sleep(1.0)
    return all(moves(swarm.robot(one)) for one in ROBOTS)


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Beside ``count`` processes that never wait."""
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for one in loops:
            one.kill()
            one.wait()


def false_alarms(swarm: LabSwarm, looks: int) -> Counter[str]:
    """Looks ``looks`` times. Returns how many were healthy, and how often each other finding came."""
    found, took = Counter[str](), list[float]()
    for _ in range(looks):
        began = time.monotonic()
        run = swarm.swarmctl("status", "--json")
        took.append(time.monotonic() - began)
        found["healthy"] += run.status == 0
        states = {one["key"]: one for one in run.json()["findings"]}
        for one in states.values():
            if one["state"] not in ("ok", "skipped"):
                found[f"{one['state']} {one['key']}: {one['message']}"] += 1
    print(f"  a look takes {median(took):.1f} s (median), {max(took):.1f} s (longest)")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--looks", type=int, default=100)
    parser.add_argument("--check", action="store_true", help="exit 1 if a look was not healthy")
    given = parser.parse_args()
    alarms = 0
    with ExitStack() as until_done:
        folder = Path(until_done.enter_context(tempfile.TemporaryDirectory(prefix="swarm-bench-")))
        os.environ[paths.STATE_VARIABLE] = str(folder)
        swarm = until_done.enter_context(lab_of(f"alarms-{os.getpid()}", SPEC, folder))
        run = swarm.deploy()
        if run.status:
            raise SystemExit(run.out + run.err)
        until_done.enter_context(driven(swarm))
        for count in (0, BUSY):
            print(f"{given.looks} looks beside {count} busy processes:", flush=True)
            with busy(count):
                found = false_alarms(swarm, given.looks)
            alarms += given.looks - found["healthy"]
            for text, times in found.most_common():
                print(f"  {times:4} {text}", flush=True)
    return int(given.check and alarms > 0)


if __name__ == "__main__":
    sys.exit(main())
