"""What `swarmctl stop` costs: ``python benchmarks/stop.py [--hosts N] [--rounds N] [--check]``.

As root, in a lab of N hosts with a driving robot each: from the start of the program to the last wheel, by
the emulators' own state, beside bare paramiko that logs in to these hosts and runs ``true``, in each round.
The verb runs as for real hosts, with keys from ``~/.ssh``: ``--lab`` would load the lab, too.
"""

from __future__ import annotations

import argparse
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from deploy import deployed, log_in_everywhere, spec_of

from swarmctl.lab import lab, paths
from swarmctl.remote.transport import Target

BAR = 0.5  # s beyond one SSH connection
_LOOK_EVERY = 0.01
SWARMCTL = Path(sys.executable).with_name("swarmctl")
SOURCE = ". /opt/swarm/bench/current/setup.bash"
DRIVE = "rostopic pub -r 10 /{}/cmd_vel geometry_msgs/Twist '[0.05, 0, 0]' '[0, 0, 0]'"


def moving(name: str) -> list[str]:
    return [robot for robot, state in lab.robots(name).items() if state["left"] or state["right"]]


def await_motion(name: str, robots: int, *, moves: bool, within: float) -> float:
    """The moment at which all robots move, or none does. Raises SystemExit if that takes longer."""
    end = time.monotonic() + within
    while time.monotonic() < end:
        now, count = time.monotonic(), len(moving(name))
        if count == (robots if moves else 0):
            return now
        time.sleep(_LOOK_EVERY)
    raise SystemExit(f"{len(moving(name))} of {robots} robots move")


def home_of(folder: Path, targets: list[Target]) -> dict[str, str]:
    """The environment of an operator who logs in to the hosts; their keys are pinned beside the spec."""
    home = folder / "home"
    (home / ".ssh").mkdir(parents=True)
    (home / ".ssh/config").write_text(f"IdentityFile {targets[0].identities[0]}\n")
    pinned = "".join(f"{one.host} {one.keys[0]}\n" for one in targets)
    (folder / "swarm.known_hosts").write_text(pinned)
    return {**os.environ, "HOME": str(home)}


def round_of(name: str, spec: Path, robots: int, operator: dict[str, str]) -> tuple[float, float]:
    """The s from the start of `swarmctl stop` until the last wheel stands, and until it has ended."""
    await_motion(name, robots, moves=True, within=60)
    stood: list[float] = []
    began = time.monotonic()
    process = subprocess.Popen([str(SWARMCTL), "stop", str(spec)], stdout=subprocess.DEVNULL, env=operator)
    watch = threading.Thread(target=lambda: stood.append(await_motion(name, robots, moves=False, within=30)))
    watch.start()
    process.wait()
    ended = time.monotonic()
    watch.join()
    subprocess.run([str(SWARMCTL), "start", str(spec)], stdout=subprocess.DEVNULL, check=True, env=operator)
    return stood[0] - began, ended - began


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hosts", type=int, default=5)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--check", action="store_true", help="fail above the bar")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as folder:
        os.environ.setdefault(paths.STATE_VARIABLE, folder)
        spec = Path(folder, "swarm.yaml")
        spec.write_text(spec_of(options.hosts))
        return measured(spec, options.hosts, options.rounds, check=options.check)


def measured(spec: Path, hosts: int, rounds: int, *, check: bool) -> int:
    name = f"bench-{os.getpid()}"
    with deployed(spec) as (targets, _):
        operator = home_of(spec.parent, targets)
        drive = " & ".join([*(DRIVE.format(f"r_{target.host}") for target in targets), "wait"])
        commanders = subprocess.Popen(  # one login: sshd drops some of ten at once
            lab.ssh_argv(name, targets[0].host, ["bash", "-c", shlex.quote(f"{SOURCE}; {drive}")]),
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            bare, stood, ended = [], [], []
            for _ in range(rounds):
                began = time.monotonic()
                log_in_everywhere(targets)
                bare.append(time.monotonic() - began)
                wheel, end = round_of(name, spec, hosts, operator)
                stood.append(wheel)
                ended.append(end)
        finally:
            commanders.kill()
    medians = [statistics.median(one) for one in (bare, stood, ended)]
    print(f"{hosts} hosts, {rounds} rounds, median (worst)")
    titles = ("bare paramiko: connect, true", "stop: key to the last wheel", "stop: key to its end")
    for title, figure, values in zip(titles, medians, (bare, stood, ended), strict=True):
        print(f"  {title:<36} {figure:6.2f} s ({max(values):.2f} s)")
    over = medians[1] - medians[0]
    print(f"  beyond one connection: {over:.2f} s, bar {BAR:.2f} s")
    return int(check and over > BAR)


if __name__ == "__main__":
    sys.exit(main())
