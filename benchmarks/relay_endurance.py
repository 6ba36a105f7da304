"""Relays on a bad radio: ``python benchmarks/relay_endurance.py [--minutes N] [--seed N]``, as root.

The Koala on ROS 1 and the TurtleBot on ROS 2 of ``examples/ros1-and-ros2``, and a Khepera on an island of
ROS 2 of its own, in the lab: a relay from ROS 1 to ROS 2, and one between islands of ROS 2. On the cable
between the hubs 0.5 % of the packets are lost and 0.5 % are late. Gamepads are held and let go at random
times. Exit 1 if a robot moves in silence, hardly moves when commanded, or if a relay grows.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from pathlib import Path
from random import Random
from statistics import fmean, median

from endurance.looks import Look, Stretch, Weight, weight

from swarmctl.cli import exit_codes
from swarmctl.lab import paths
from swarmctl.lab.hosts import network, processes
from tests.e2e.experiment import STILL, Experiment, Gamepad, seconds_to_health
from tests.e2e.lab_swarm import HOME, LEADER, LabSwarm, lab_of, moves
from tests.e2e.lossy_cable import lossy_cable
from tests.timing import RunQueue, withheld

SPEC = Path(__file__).parent / "endurance/swarm.yaml"
MIDDLE, FAR = "tb3-pi", "k3-pi"  # the hosts with relays
SHARE = 0.005  # of the packets are lost, and as many late
LOOK_EVERY, WEIGH_EVERY = 0.05, 10.0  # s
FOLLOWED, GROWTH = 0.8, 1.03  # bars: of the time a button is held, last third of the memory to the second


def inside(swarm: LabSwarm, host: str) -> list[int]:
    """The processes of a host."""
    return processes.in_network_namespaces([network.namespace_path(paths.lab_paths(swarm.name), host)])


def relay_of(swarm: LabSwarm, host: str) -> int:
    """The process of the relay on a host."""
    (found,) = set(inside(swarm, host)) & set(
        processes.with_arguments("--config", f"{HOME}/current/params/relay.yaml")
    )
    return found


def stretches(random: Random) -> Iterator[tuple[bool, float]]:
    """Whether the buttons are held, and for how many s; for ever."""
    while True:
        yield False, random.uniform(2, 5) if random.random() < 0.75 else random.uniform(10, 40)
        yield True, random.uniform(0.7, 8) if random.random() < 0.85 else random.uniform(10, 20)


@dataclass(frozen=True)
class Endured:
    """What was seen of the robots and of the relays, by host; what is wrong at the end.

    ``busy``: for how many s some process of the machine waited for a CPU.
    """

    stretches: Sequence[Stretch]
    weights: Mapping[str, Sequence[Weight]]
    busy: float
    wrong: Sequence[str]


def endured(experiment: Experiment, pads: Sequence[Gamepad], seconds: float, seed: int) -> Endured:
    swarm, random = experiment.lab, Random(seed)
    before, pids = swarm.pids(), {host: relay_of(swarm, host) for host in (MIDDLE, FAR)}
    everyone, busy = [pid for host in swarm.hosts for pid in inside(swarm, host)], withheld()
    weights: dict[str, list[Weight]] = {host: [] for host in pids}
    found: list[Stretch] = []
    end, weigh = time.monotonic() + seconds, time.monotonic()
    for held, length in stretches(random):
        for pad in pads:
            pad.hold(1.0) if held else pad.let_go()
        stretch, queue = Stretch(held, time.monotonic()), RunQueue(*everyone)
        found.append(stretch)
        while (now := time.monotonic()) < stretch.began + length:
            stretch.saw(look(swarm), queue)
            if now >= weigh:
                weigh += WEIGH_EVERY
                for host, pid in pids.items():
                    weights[host].append(weight(pid))
                print(f"\r{end - now:6.0f} s left", end="", file=sys.stderr)
            time.sleep(max(0.0, now + LOOK_EVERY - time.monotonic()))
        if not held and time.monotonic() > end:
            break
    return Endured(found, weights, withheld() - busy, list(wrong(swarm, before)))


def look(swarm: LabSwarm) -> Look:
    states = swarm.robots()
    moving = frozenset(name for name, one in states.items() if moves(one))
    ways = {name: one["distance"] for name, one in states.items()}
    return Look(time.monotonic(), moving, ways)


def wrong(swarm: LabSwarm, before: Mapping[str, int]) -> Iterator[str]:
    """Units that run no more as they did, and what `status` says."""
    now = swarm.pids()
    yield from (f"{unit} was restarted" for unit, pid in before.items() if now.get(unit) != pid)
    status = swarm.swarmctl("status")
    if status.status != exit_codes.OK:
        yield status.out


@contextmanager
def driven(folder: Path) -> Iterator[tuple[Experiment, list[Gamepad]]]:
    """The swarm in a lab, deployed and healthy, with its two gamepads."""
    with lab_of(f"endure-{os.getpid()}", SPEC, folder) as swarm, ExitStack() as stack:
        deploy = swarm.timed_deploy()
        if deploy.status:
            raise SystemExit(deploy.out + deploy.err)
        healthy = seconds_to_health(swarm)
        experiment = Experiment(swarm, swarm.swarm, {"then healthy": healthy})
        yield experiment, [stack.enter_context(experiment.gamepad(host)) for host in (LEADER, MIDDLE)]


def bars_of_robots(found: Endured, robots: Sequence[str]) -> Iterator[tuple[str, bool]]:
    """Prints the table of the robots; yields each bar, and whether it is kept."""
    free = [one for one in found.stretches if not one.held]
    held = [one for one in found.stretches if one.held]
    print(f"{'':8}{'held: moves after, s':>24}{'free: stands after, s':>24}{'% of held':>12}{'pauses':>8}")
    print(f"{'':8}{'median (worst)':>24}{'median (worst)':>24}")
    for robot in robots:
        starts = [one for stretch in held if (one := stretch.until(robot, moving=True)) is not None] or [inf]
        stops = [one for stretch in free if (one := stretch.until(robot, moving=False)) is not None] or [inf]
        share = sum(one.share(robot) * len(one.looks) for one in held) / sum(len(one.looks) for one in held)
        times = "".join(f"{median(some):15.2f} ({max(some):6.2f})" for some in (starts, stops))
        pauses = sum(one.pauses(robot) for one in held)
        print(f"{robot:8}{times}{100 * share:12.1f}{pauses:8}")
        late = [(over, stretch.lost) for stretch in free if (over := stretch.late(robot))]
        shown = ", ".join(f"{over:.2f} s (machine {lost:.2f} s)" for over, lost in late) or "never"
        yield (
            f"{robot}: moves later than {STILL} s after the button: {shown}",
            all(over <= lost for over, lost in late),
        )
        crept = max(stretch.crept(robot) for stretch in free)
        yield f"{robot}: moves between two looks in silence: {1000 * crept:.1f} mm", not crept
        yield (
            f"{robot}: moves {share:.1%} >= {FOLLOWED:.0%} of the time the button is held",
            share >= FOLLOWED,
        )


def bars_of_relay(host: str, weights: Sequence[Weight]) -> Iterator[tuple[str, bool]]:
    """Prints the table of a relay, a line a minute; yields each bar, and whether it is kept."""
    print(f"\n{host:8}{'minute':>8}{'RSS MB':>10}{'files':>8}{'threads':>8}")
    for number, one in enumerate(weights[:: round(60 / WEIGH_EVERY)]):
        print(f"{'':8}{number:8}{one.resident:10.2f}{one.files:8}{one.threads:8}")
    third = len(weights) // 3
    second, last = weights[third : 2 * third], weights[2 * third :]
    growth = fmean(one.resident for one in last) / fmean(one.resident for one in second)
    yield f"{host}: RSS of the last third {growth:.3f} <= {GROWTH} x that of the second", growth <= GROWTH
    for what in ("files", "threads"):
        before, after = (min(getattr(one, what) for one in some) for some in (second, last))
        yield f"{host}: {what} of the last third, at least, {after} <= {before}", after <= before


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="swarm-bench-"))
    os.environ[paths.STATE_VARIABLE] = str(folder)
    try:
        with driven(folder) as (experiment, pads):
            with lossy_cable(experiment.lab, MIDDLE, SHARE, given.seed) as packets:
                found = endured(experiment, pads, 60 * given.minutes, given.seed)
            robots = tuple(experiment.spec.robots)
    finally:
        shutil.rmtree(folder)
    print(f"\npackets on the cable of {MIDDLE}: {dict(packets)}")
    print(f"buttons held {sum(one.held for one in found.stretches)} times; {paces(found)}\n")
    kept = list(bars_of_robots(found, robots))
    for host, weights in found.weights.items():
        kept += bars_of_relay(host, weights)
    kept += [("no unit was restarted, and all is healthy at the end", not found.wrong)]
    print()
    for bar, good in kept:
        print(f"{'PASS' if good else 'FAIL'}: {bar}")
    print("\n".join(found.wrong))
    return int(not all(good for _, good in kept))


def paces(found: Endured) -> str:
    looks = [one for stretch in found.stretches for one in stretch.looks]
    seconds = looks[-1].moment - looks[0].moment
    longest = max(after.moment - before.moment for before, after in pairwise(looks))
    return (
        f"{len(looks) / seconds:.1f} looks a second, the longest pause {longest:.2f} s; "
        f"some process waited for a CPU in {found.busy / seconds:.0%} of it"
    )


if __name__ == "__main__":
    sys.exit(main())
