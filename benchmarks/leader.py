"""What one leader bears: ``python benchmarks/leader.py [--robots N] [--seconds S] [--check]``, as root.

A single-minded swarm of N robots on one host in the lab, all driven. For every driver: memory, CPU, the rates
that it reaches, and the time from a command to the wheels; beside it a bare rospy node with the same topics.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from swarmctl.deploy.outcome import Outcome
from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import network, processes
from swarmctl.lab.lab_plan import plan_of
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import Target
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.names import robot_namespace
from swarmctl.swarm.resolved import Swarm
from tests.deploy.deploying import deploy
from tests.loading import load_swarm

HOST = "leader"
BARE = "bare"
HOME = "/opt/swarm/bench"
SHARES = {"koala": 0.2, "khepera3": 0.3, "epuck": 0.5}  # of the robots
SPEEDS = {"koala": 0.2, "khepera3": 0.1, "epuck": 0.05}  # m/s
MEMORY, CPU, RATE = 60.0, 2.0, 0.9  # bars: MB of a driver, % of one core, of the wanted rate
CHANGES = 10  # of speed, for the time from a command to the wheels
SHOWN = 10  # slow topics
PATIENCE = 60.0  # s
TICKS = os.sysconf("SC_CLK_TCK")
ONHOST = Path(__file__).parent / "onhost"


@dataclass(frozen=True)
class Usage:
    """What a process has used and holds: s of CPU, MB resident, MB if what is shared is shared out."""

    cpu: float
    resident: float
    share: float


@dataclass(frozen=True)
class Cost:
    """What a process cost over some time: % of one core, and its memory, MB."""

    cpu: float
    resident: float
    share: float


def spec_of(robots: int) -> str:
    """A swarm of ``robots`` robots on one host, those of K-Team by cable, the e-pucks on three radios."""
    koalas = max(1, round(robots * SHARES["koala"]))
    kheperas = max(1, round(robots * SHARES["khepera3"]))
    epucks = robots - koalas - kheperas
    adapters = ", ".join(f"hci{number % 3}" for number in range(epucks))
    return f"""\
version: 1
name: bench
mode: single-minded
leader: {HOST}
hosts:
  {HOST}: {{address: 10.77.0.10, user: robot, bluetooth: [hci0, hci1, hci2]}}
robots:
  koala-[1-{koalas}]: {{type: koala}}
  k3-[1-{kheperas}]: {{type: khepera3}}
  epuck-[1-{epucks}]: {{type: epuck}}
links:
  - {{kind: serial, host: {HOST}, robot: "koala-[1-{koalas}]", usb: {{serial: "KOALA[1-{koalas}]"}}}}
  - {{kind: serial, host: {HOST}, robot: "k3-[1-{kheperas}]", usb: {{serial: "FTDI[1-{kheperas}]"}}}}
  - kind: bluetooth
    host: {HOST}
    robot: epuck-[1-{epucks}]
    mac: "10:00:e8:c5:64:[01-{epucks:02}]"
    adapter: {{each: [{adapters}]}}
control: [{{by: {HOST}, of: ["koala-[1-{koalas}]", "k3-[1-{kheperas}]", "epuck-[1-{epucks}]"]}}]
"""


@contextmanager
def booted(swarm: Swarm) -> Iterator[str]:
    """The swarm in a lab, deployed; the lab's name."""
    name = f"bench-{os.getpid()}"
    try:
        lab.up(plan_of(swarm, name), lambda line: print(f"  {line}", file=sys.stderr))
        way = lab.operator(name)
        host = swarm.hosts[HOST]
        target = Target(HOST, host.address, host.user, host.port, way.keys[HOST], (way.identity,))
        network.within(way.namespace, lambda: put(swarm, target))
        yield name
    finally:
        lab.down(name)


def put(swarm: Swarm, target: Target) -> None:
    for event in deploy(bundles(swarm), {HOST: target}, SshTransport(), parallel=1):
        if isinstance(event, Finished) and not isinstance(event.outcome, Outcome):
            raise SystemExit(f"the deploy failed: {event.outcome}")


class Leader:
    """The host in its lab, and the measurements on it."""

    def __init__(self, swarm: Swarm, name: str) -> None:
        self.swarm = swarm
        self._name = name
        self._namespace = lab.operator(name).namespace

    @contextmanager
    def running(self, script: str, *arguments: object) -> Iterator[subprocess.Popen[str]]:
        """A script of ``onhost`` on the host, under the swarm's ROS; it ends when its input does."""
        program = (ONHOST / script).read_text("utf-8").replace("'", "'\\''")
        words = " ".join(map(str, arguments))
        command = f"source {HOME}/current/setup.bash; exec python3 -uc '{program}' {words}"
        argv = lab.ssh_argv(self._name, HOST, ["bash -c '" + command.replace("'", "'\\''") + "'"])
        pipe = subprocess.PIPE
        with subprocess.Popen(
            ["nsenter", f"--net={self._namespace}", *argv], stdin=pipe, stdout=pipe, text=True
        ) as process:
            try:
                yield process
            finally:
                assert process.stdin is not None
                process.stdin.close()
                process.terminate()

    def drivers(self) -> dict[str, int]:
        """The process of every robot's driver."""
        found = {}
        for robot in self.swarm.robots:
            (found[robot],) = processes.with_arguments("--config", f"{HOME}/current/params/{robot}.yaml")
        return found

    def all(self) -> list[int]:
        """Every process of the host."""
        place = paths.lab_paths(self._name)
        return processes.in_network_namespaces([network.namespace_path(place, HOST)])

    def moving(self) -> dict[str, bool]:
        return {name: bool(one["left"] or one["right"]) for name, one in lab.robots(self._name).items()}

    def awaits(self, condition: Callable[[Mapping[str, bool]], bool], complaint: str) -> float:
        """Look until ``condition`` of what moves holds; the moment at which it did."""
        end = time.monotonic() + PATIENCE
        while not condition(self.moving()):
            if time.monotonic() > end:
                raise SystemExit(complaint)
        return time.monotonic()

    def topics(self) -> dict[str, float]:
        """The rates that the drivers are to reach, Hz by topic."""
        return {
            f"{robot_namespace(name, None)}/{one.name}": one.rate
            for name, robot in self.swarm.robots.items()
            for one in robot.topics
            if not one.name.startswith("/")
        }


def usage(pid: int) -> Usage:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    memory = dict(
        line.split(":", 1) for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]
    )
    resident, share = (int(memory[key].split()[0]) / 1024 for key in ("Rss", "Pss"))
    return Usage((int(fields[11]) + int(fields[12])) / TICKS, resident, share)


def costs(pids: Mapping[str, int], seconds: float) -> dict[str, Cost]:
    """What processes cost over the next ``seconds``."""
    before, began = {name: usage(pid) for name, pid in pids.items()}, time.monotonic()
    time.sleep(seconds)
    after, took = {name: usage(pid) for name, pid in pids.items()}, time.monotonic() - began
    return {
        name: Cost(100 * (one.cpu - before[name].cpu) / took, one.resident, one.share)
        for name, one in after.items()
    }


@dataclass(frozen=True)
class Measured:
    """A bare node; each driver without and with a subscriber of all its topics; then the whole host.

    ``rates`` are Hz by topic, ``first`` and ``last`` the s from a command to the first and to the last robot.
    """

    bare: Cost
    drivers: Mapping[str, Cost]
    subscribed: Mapping[str, Cost]
    host: float
    rates: Mapping[str, float]
    first: Sequence[float]
    last: Sequence[float]


def measured(leader: Leader, seconds: float) -> Measured:
    robots = leader.swarm.robots
    speeds = [f"{robot_namespace(name, None)}={SPEEDS[robot.type_name]}" for name, robot in robots.items()]
    with leader.running("drive.py", *speeds, "/bare=0") as drive:
        with leader.running("bare.py", "/bare", 10, 5):
            move(drive, 1.0)
            leader.awaits(lambda seen: all(seen.values()), "not every robot moves")
            time.sleep(5.0)  # until all is imported and connected
            drivers, (bare,) = leader.drivers(), processes.with_arguments("-uc", "/bare")
            alone = costs({**drivers, BARE: bare}, seconds)
        with leader.running("listen.py", seconds, *leader.topics()) as listen:
            time.sleep(3.0)
            subscribed = costs({str(pid): pid for pid in leader.all()}, seconds - 1)
            assert listen.stdout is not None
            rates = json.loads(listen.stdout.readline())
        first, last = zip(*(latency(leader, drive, bool(turn % 2)) for turn in range(CHANGES)), strict=True)
    return Measured(
        bare=alone.pop(BARE),
        drivers=alone,
        subscribed={name: subscribed[str(pid)] for name, pid in drivers.items()},
        host=sum(one.cpu for one in subscribed.values()),
        rates=rates,
        first=first,
        last=last,
    )


def move(drive: subprocess.Popen[str], factor: float) -> float:
    """Have all robots go at ``factor`` of their speeds; the moment of the first such command."""
    assert drive.stdin is not None
    assert drive.stdout is not None
    drive.stdin.write(f"{factor}\n")
    drive.stdin.flush()
    return float(drive.stdout.readline())


def latency(leader: Leader, drive: subprocess.Popen[str], moves: bool) -> tuple[float, float]:
    """Seconds from a command to all robots until the first and until the last obeys."""
    time.sleep(0.5)
    commanded = move(drive, float(moves))
    first = leader.awaits(lambda seen: moves in seen.values(), "no robot obeys")
    last = leader.awaits(lambda seen: set(seen.values()) == {moves}, "a robot does not obey")
    return first - commanded, last - commanded


def shown(swarm: Swarm, found: Measured, wanted: Mapping[str, float]) -> bool:
    """Print the table; whether every bar is kept."""
    slow = {topic: found.rates[topic] for topic, rate in wanted.items() if found.rates[topic] < RATE * rate}
    print(f"{'driver of':12}{'CPU %':>8}{'x bare':>8}{'subscr. %':>9}{'RSS MB':>8}{'PSS MB':>8}{'topics':>8}")
    for name in swarm.robots:
        own, subscribed = found.drivers[name], found.subscribed[name]
        topics = sum(topic.startswith(f"{robot_namespace(name, None)}/") for topic in wanted)
        print(
            f"{name:12}{own.cpu:8.2f}{own.cpu / found.bare.cpu:8.1f}{subscribed.cpu:9.2f}"
            f"{own.resident:8.1f}{own.share:8.1f}{topics:8}"
        )
    bare = found.bare
    print(f"{'bare node':12}{bare.cpu:8.2f}{1:8.1f}{'':9}{bare.resident:8.1f}{bare.share:8.1f}")
    print(f"the host in all, while all topics are subscribed: {found.host:.1f} % of one core")
    print(f"command to the first robot: median {median(found.first):.3f} s, highest {max(found.first):.3f} s")
    print(f"command to the last robot: median {median(found.last):.3f} s, highest {max(found.last):.3f} s")
    for topic, rate in list(slow.items())[:SHOWN]:
        print(f"{topic} comes at {rate:.1f} instead of {wanted[topic]:g} Hz")
    memory = max(one.resident for one in found.drivers.values())
    idle, busy = (median([one.cpu for one in all_.values()]) for all_ in (found.drivers, found.subscribed))
    bars = {
        f"RSS of a driver: {memory:.1f} <= {MEMORY:g} MB": memory <= MEMORY,
        f"CPU of a driver, median: {idle:.2f} <= {CPU:g} %": idle <= CPU,
        f"the same, while it is subscribed: {busy:.2f} <= {CPU:g} %": busy <= CPU,
        f"rates: {len(wanted) - len(slow)} of {len(wanted)} >= {RATE:.0%} of what is wanted": not slow,
    }
    for bar, kept in bars.items():
        print(f"{'PASS' if kept else 'FAIL'}: {bar}")
    return all(bars.values())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0, help="how long CPU and rates are measured")
    parser.add_argument("--check", action="store_true", help="exit 1 when a bar is missed")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="swarm-bench-"))
    os.environ[paths.STATE_VARIABLE] = str(folder)
    try:
        spec = folder / "bench.yaml"
        spec.write_text(spec_of(given.robots))
        swarm, diagnostics = load_swarm(spec)
        if swarm is None:
            raise SystemExit(f"the benchmark's own spec is wrong: {diagnostics}")
        with booted(swarm) as name:
            leader = Leader(swarm, name)
            kept = shown(swarm, measured(leader, given.seconds), leader.topics())
        return int(not kept and given.check)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    sys.exit(main())
