"""What discovery puts on the network: ``python benchmarks/discovery.py [--seconds S]``, as root.

In the lab, nodes of rclpy that publish nothing, on three hosts, by each method of discovery: packets and
bytes that the hosts send while the nodes start and find each other, and from then on, at rest.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from leader import HOME, ONHOST

from swarmctl.deploy.outcome import Outcome
from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import image, network
from swarmctl.lab.lab_plan import plan_of
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import Target
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.resolved import Swarm
from tests.deploy.deploying import deploy
from tests.loading import load_swarm

DISTRO = "jazzy"
METHODS = ("peers", "server", "multicast")
NODES = (3, 6, 12, 20)
HOSTS = ("one", "two", "three")
SETTLED = 5.0  # s after all topics are connected, in which the rest is announced
SPEC = """\
version: 1
name: bench
mode: leader
leader: one
ros: {{distro: {distro}, discovery: {method}}}
hosts: {{one: {{address: 10.77.0.10}}, two: {{address: 10.77.0.11}}, three: {{address: 10.77.0.12}}}}
robots: {{koala: {{type: koala, host: one}}}}
links:
  - {{kind: wlan, name: lab, hosts: [one, two, three]}}
  - {{kind: serial, host: one, robot: koala, usb: {{serial: KOALA1}}}}
programs:
"""
PROGRAM = "  n{}: {{host: {}, package: ring, executable: ring, lifecycle: interactive, optional: true}}\n"


@dataclass(frozen=True)
class Sent:
    """What all hosts have sent: packets, bytes."""

    packets: int
    bytes: int

    def since(self, before: Sent) -> Sent:
        return Sent(self.packets - before.packets, self.bytes - before.bytes)


@dataclass(frozen=True)
class Measured:
    """What was sent from the start of the nodes on until they had settled; at rest, in ``seconds``."""

    start: Sent
    rest: Sent
    seconds: float


def swarm_of(folder: Path, method: str, count: int) -> Swarm:
    """The swarm with ``count`` nodes as its programs, which are started by hand here."""
    spec = folder / f"{method}-{count}.yaml"
    programs = "".join(PROGRAM.format(number, HOSTS[number % len(HOSTS)]) for number in range(count))
    spec.write_text(SPEC.format(distro=DISTRO, method=method) + programs)
    swarm, diagnostics = load_swarm(spec)
    if swarm is None:
        raise SystemExit(f"the benchmark's own spec is wrong: {diagnostics}")
    return swarm


@contextmanager
def booted(swarm: Swarm) -> Iterator[str]:
    """The swarm in a lab, deployed; the lab's name. Its driver does not run."""
    name = f"bench-{os.getpid()}"
    try:
        lab.up(plan_of(swarm, name), lambda line: print(f"  {line}", file=sys.stderr))
        way = lab.operator(name)
        targets = {
            host.name: Target(
                host.name, host.address, host.user, host.port, way.keys[host.name], (way.identity,)
            )
            for host in swarm.hosts.values()
        }
        network.within(way.namespace, lambda: put(swarm, targets))
        with shell(name, HOSTS[0], "sudo systemctl stop swarm-bench.koala") as stop:
            stop.wait()
        yield name
    finally:
        lab.down(name)


def put(swarm: Swarm, targets: dict[str, Target]) -> None:
    for event in deploy(bundles(swarm), targets, SshTransport(), parallel=1):
        if isinstance(event, Finished) and not isinstance(event.outcome, Outcome):
            raise SystemExit(f"the deploy failed: {event.outcome}")


def shell(name: str, host: str, command: str) -> subprocess.Popen[str]:
    argv = lab.ssh_argv(name, host, [f"bash -c {quoted(command)}"])
    inside = ["nsenter", f"--net={lab.operator(name).namespace}", *argv]
    return subprocess.Popen(inside, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def quoted(text: str) -> str:
    return "'" + text.replace("'", "'\\''") + "'"


@contextmanager
def nodes(name: str, host: str, numbers: Sequence[int], count: int) -> Iterator[subprocess.Popen[str]]:
    """Nodes of the ring on a host, as units run them: they start with a line of input, and end with it."""
    script = quoted((ONHOST / "ring.py").read_text("utf-8"))
    command = (
        f"set -a; . {HOME}/current/env/ros.env; set +a; read; for number in {' '.join(map(str, numbers))}; "
        f"do {HOME}/current/bin/ros-exec python3 -uc {script} $number {count} 2>/dev/null & done; "
        "cat; kill $(jobs -p); wait"
    )
    with shell(name, host, command) as process:
        assert process.stdin is not None
        try:
            yield process
        finally:
            process.stdin.close()
            process.wait()


def sent(name: str) -> Sent:
    """What the hosts have sent so far, by the counters of their interfaces."""
    place = paths.lab_paths(name)
    rows = [
        line.split(":")[1].split()
        for host in HOSTS
        for line in network.within(network.namespace_path(place, host), interfaces)
    ]
    return Sent(sum(int(row[9]) for row in rows), sum(int(row[8]) for row in rows))


def interfaces() -> list[str]:
    """What this thread's network knows of its interfaces, apart from the loopback."""
    lines = Path("/proc/thread-self/net/dev").read_text().splitlines()[2:]
    return [line for line in lines if not line.strip().startswith("lo:")]


def measured(name: str, count: int, seconds: float) -> Measured:
    with ExitStack() as stack:
        running = [
            stack.enter_context(nodes(name, host, range(first, count, len(HOSTS)), count))
            for first, host in enumerate(HOSTS)
        ]
        time.sleep(1.0)  # until all are logged in
        before = sent(name)
        for process in running:
            assert process.stdin is not None
            process.stdin.write("\n")
            process.stdin.flush()
        for first, process in enumerate(running):
            assert process.stdout is not None
            for _ in range(first, count, len(HOSTS)):
                process.stdout.readline()
        time.sleep(SETTLED)
        settled, began = sent(name), time.monotonic()
        time.sleep(seconds)
        return Measured(settled.since(before), sent(name).since(settled), time.monotonic() - began)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=15.0, help="how long nodes at rest are measured")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="swarm-bench-"))
    os.environ[paths.STATE_VARIABLE] = str(folder)
    image.ensure(lambda line: print(f"  image: {line}", file=sys.stderr), distro=DISTRO)
    print("| discovery | nodes | start, packets | start, kB | at rest, packets/s | at rest, kB/s |")
    print("|---|---|---|---|---|---|")
    try:
        for method in METHODS:
            for count in NODES:
                with booted(swarm_of(folder, method, count)) as name:
                    found = measured(name, count, given.seconds)
                print(
                    f"| `{method}` | {count} | {found.start.packets} | {found.start.bytes / 1000:.0f}"
                    f" | {found.rest.packets / found.seconds:.1f}"
                    f" | {found.rest.bytes / found.seconds / 1000:.1f} |",
                    flush=True,
                )
    finally:
        shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
