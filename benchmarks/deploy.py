"""What deploying costs: ``python benchmarks/deploy.py [--hosts N] [--rounds N] [--check | --profile]``.

As root, in a lab of N hosts, beside bare paramiko that logs in to the same hosts and runs ``true``, round by
round.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import paramiko
from deploy_cost import profile

from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.outcome import Outcome
from swarmctl.deploy.rollout import observe
from swarmctl.lab import lab, paths
from swarmctl.lab.hosts import network
from swarmctl.lab.lab_plan import plan_of
from swarmctl.remote.either_ssh import EitherSsh
from swarmctl.remote.kept_connections import KeptConnections
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import Target, Transport
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle, File
from tests.deploy.deploying import deploy
from tests.loading import load_swarm

FILES = 20
AT_ONCE = Terms(healthy_for=0.0, healthy_within=30.0)  # how long a unit is watched is chosen, and no cost
BARE = "bare paramiko: connect, true"
# What a look at the states of the units costs at least, and one by a program in Python as root.
STATES = "systemctl show -p Id,ActiveState -- {units}"
LOOK = "sudo -n sh -c 'python3 -I -S -c pass; systemctl show -p Id,ActiveState -- {units}'"
WRITE = """sudo -n sh -c 'systemctl show -p Id,ActiveState -- {units}; cd /opt; python3 -I -S -c "
import os
os.mkdir(str(os.getpid()))
for number in range({files}):
    with open(str(os.getpid()) + chr(47) + str(number), chr(119)) as file:
        file.write(str(number) * 2000)
print(os.getpid())
" | (read made; sync -f $made; rm -r $made)'"""
RESTART = "sudo -n systemctl restart 'swarm-bench.r-*.service'"  # the drivers report READY
Bundles = Mapping[str, Bundle]
_LOOK, _RESTS, _REST_WITHIN = 0.5, 0.2, 30.0  # s; share of the processors that work at rest; s


@dataclass(frozen=True)
class Task:
    """Something to measure, and how many times as long as the bare login it may take."""

    name: str
    run: Callable[[], None]
    bar: float | None = None


def spec_of(hosts: int) -> str:
    """A swarm of ``hosts`` hosts with a robot each, under one leader."""
    names = [f"h{number}" for number in range(hosts)]
    lines = ["version: 1", "name: bench", "mode: leader", f"leader: {names[0]}", "hosts:"]
    lines += [
        f"  {name}: {{address: 10.77.{n // 200}.{n % 200 + 10}, user: robot}}" for n, name in enumerate(names)
    ]
    lines += ["robots:", *(f"  r-{name}: {{type: khepera3, host: {name}}}" for name in names)]
    lines += ["links:", f"  - {{kind: wlan, name: lab, hosts: [{', '.join(names)}], subnet: 10.77.0.0/16}}"]
    lines += [
        f"  - {{kind: serial, host: {name}, robot: r-{name}, usb: {{serial: S{name}}}}}" for name in names
    ]
    return "\n".join(lines) + "\n"


@contextmanager
def booted(spec: Path) -> Iterator[tuple[Path, list[Target], Bundles]]:
    """A lab of the spec's hosts: its network namespace, how to reach the hosts, what to deploy."""
    swarm, diagnostics = load_swarm(spec)
    if swarm is None:
        raise SystemExit(f"the benchmark's own spec is wrong: {diagnostics}")
    name = f"bench-{os.getpid()}"
    try:
        lab.up(plan_of(swarm, name), lambda line: print(f"  {line}", file=sys.stderr))
        way = lab.operator(name)
        targets = [
            Target(host.name, host.address, host.user, host.port, way.keys[host.name], (way.identity,))
            for host in swarm.hosts.values()
        ]
        yield way.namespace, targets, bundles(swarm)
    finally:
        lab.down(name)


@contextmanager
def deployed(spec: Path) -> Iterator[tuple[list[Target], Bundles]]:
    """A lab whose hosts have their releases; this process is in its network. Raises SystemExit."""
    with booted(spec) as (namespace, targets, wanted):
        network.enter(namespace)
        reach = {target.host: target for target in targets}
        carry_out(wanted, reach, SshTransport(), changes=True)
        yield targets, wanted


def log_in_everywhere(targets: list[Target], command: str = "true") -> None:
    """Logs in to all hosts at once, and runs ``command``."""
    with ThreadPoolExecutor(len(targets)) as pool:
        list(pool.map(lambda target: log_in(target, command), targets))


def log_in(target: Target, command: str = "true") -> None:
    """What nobody can do without: TCP, keys, login, one command."""
    kind, key = target.keys[0].split()
    with paramiko.SSHClient() as client:
        known = paramiko.hostkeys.HostKeyEntry.from_line(f"{target.address} {kind} {key}")
        assert known is not None
        client.get_host_keys().add(target.address, kind, known.key)
        client.connect(
            target.address, target.port, target.user, key_filename=str(target.identities[0]),
            allow_agent=False, look_for_keys=False,
        )  # fmt: skip
        _, output, _ = client.exec_command(command)
        if output.channel.recv_exit_status() != 0:
            raise SystemExit(f"`{command}` failed on {target.host}")


def with_files(wanted: Bundles, version: int) -> dict[str, Bundle]:
    """The bundles and ``FILES`` files that no unit needs, other ones for each ``version``."""
    extra = tuple(
        File(f"data/{number}.txt", f"{version} {number} ".encode() * 300) for number in range(FILES)
    )
    return {host: replace(bundle, files=bundle.files + extra) for host, bundle in wanted.items()}


def retuned(wanted: Bundles, version: int, *, live: bool = False) -> dict[str, Bundle]:
    """The bundles with a change in the file of parameters: every driver restarts, or takes it if ``live``."""
    change = b"# %d\n" % version

    def touched(file: File) -> File:
        if not file.path.startswith("params/"):
            return file
        return replace(file, content=file.content + change, fixed=file.fixed + (b"" if live else change))

    return {host: replace(bundle, files=tuple(map(touched, bundle.files))) for host, bundle in wanted.items()}


def carry_out(chosen: Bundles, reach: Mapping[str, Target], transport: Transport, *, changes: bool) -> None:
    """Deploys. Raises SystemExit if a host fails, or is changed where it should not be."""
    for event in deploy(chosen, reach, transport, parallel=len(reach), terms=AT_ONCE):
        if isinstance(event, Finished):
            result = event.outcome
            if not isinstance(result, Outcome) or result.changed is not changes:
                raise SystemExit(f"{event.host}: {result}")


def tasks(targets: list[Target], wanted: Bundles) -> list[Task]:
    reach = {target.host: target for target in targets}
    kept = KeptConnections(EitherSsh(), Path(os.environ[paths.STATE_VARIABLE], "keeper"))
    versions = iter(range(1, 1 << 20))
    words = {"units": " ".join(unit.name for unit in wanted[targets[0].host].units), "files": FILES}

    def changed(chosen: Bundles, *, changes: bool) -> None:
        carry_out(chosen, reach, SshTransport(), changes=changes)

    def plan() -> None:
        made = observe(wanted, reach, SshTransport(), parallel=len(targets))
        if made.changes or made.problems:
            raise SystemExit("the plan is not empty")

    return [
        Task(BARE, lambda: log_in_everywhere(targets)),
        Task("floor: systemctl show", lambda: log_in_everywhere(targets, STATES.format(**words))),
        Task("floor: Python as root, systemctl", lambda: log_in_everywhere(targets, LOOK.format(**words))),
        Task("plan, nothing to do", plan),
        Task("deploy, nothing to do", lambda: changed(wanted, changes=False), 1.3),
        Task("the same, the next verb", lambda: carry_out(wanted, reach, kept, changes=False), 0.5 * 1.3),
        Task(f"floor: {FILES} files, synced", lambda: log_in_everywhere(targets, WRITE.format(**words))),
        Task(
            f"deploy, {FILES} files changed",
            lambda: changed(with_files(wanted, next(versions)), changes=True),
            1.6,
        ),
        Task(
            "deploy, live parameters",
            lambda: changed(retuned(wanted, next(versions), live=True), changes=True),
        ),
        Task("floor: systemctl restart", lambda: log_in_everywhere(targets, RESTART)),
        Task("deploy, every driver restarts", lambda: changed(retuned(wanted, next(versions)), changes=True)),
        Task("", lambda: changed(wanted, changes=True)),  # back to where the round began, not shown
    ]


def profiles(target: Target, wanted: Bundle, rounds: int) -> dict[str, profile.Costs]:
    """The steps with one host, by what is done."""
    versions = iter(range(1 << 20, 1 << 21))

    def changed(change: Callable[[Bundles, int], Bundles]) -> Callable[[Transport], None]:
        def once(transport: Transport) -> None:
            chosen = change({target.host: wanted}, next(versions))
            carry_out(chosen, {target.host: target}, transport, changes=True)

        return once

    return {
        "one host, nothing to do": profile.on_a_host(target, wanted, rounds),
        f"one host, {FILES} files changed": profile.of_a_deploy(changed(with_files), rounds),
        "one host, one driver restarts": profile.of_a_deploy(changed(retuned), rounds),
        profile.FLOOR: profile.floor(target, lambda: log_in(target), rounds),
    }


def await_rest() -> None:
    """Returns once this machine has little to do: drivers that start slow down what is measured next."""
    end = time.monotonic() + _REST_WITHIN
    while time.monotonic() < end:
        before, began = _busy(), time.monotonic()
        time.sleep(_LOOK)
        if _busy() - before < _RESTS * (time.monotonic() - began) * (os.cpu_count() or 1):
            return


def _busy() -> float:
    """The s that all processors together have worked since the boot (proc_stat(5))."""
    user, nice, system = Path("/proc/stat").read_text().split()[1:4]
    return (int(user) + int(nice) + int(system)) / os.sysconf("SC_CLK_TCK")


def measured(chosen: list[Task], rounds: int) -> list[dict[str, float]]:
    """Seconds of every task, round by round; a first round to warm up is not counted."""
    found = []
    for _ in range(rounds + 1):
        seconds = {}
        for task in chosen:
            await_rest()
            began = time.perf_counter()
            task.run()
            seconds[task.name] = time.perf_counter() - began
        found.append(seconds)
    return found[1:]


def shown(chosen: list[Task], rounds: list[dict[str, float]]) -> bool:
    """Print the table; whether every bar is kept."""
    kept = True
    print(f"{'':34}{'median s':>10}{'x bare':>8}{'lowest':>8}{'highest':>8}  bar")
    for task in chosen:
        if not task.name:
            continue
        seconds = statistics.median(one[task.name] for one in rounds)
        ratios = sorted(one[task.name] / one[BARE] for one in rounds)
        ratio = statistics.median(ratios)
        kept = kept and (task.bar is None or ratio <= task.bar)
        bar = "" if task.bar is None else f"<= {task.bar}"
        print(f"{task.name:34}{seconds:10.3f}{ratio:8.2f}{ratios[0]:8.2f}{ratios[-1]:8.2f}  {bar}")
    return kept


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hosts", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--check", action="store_true", help="fail when a bar is missed")
    parser.add_argument("--profile", action="store_true", help="print where the time goes, step by step")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="swarm-bench-"))
    os.environ[paths.STATE_VARIABLE] = str(folder)
    try:
        spec = folder / "bench.yaml"
        spec.write_text(spec_of(given.hosts))
        with booted(spec) as (namespace, targets, wanted):
            chosen = tasks(targets, wanted)
            network.within(namespace, chosen[-1].run)  # the first deploy
            if given.profile:
                target = targets[-1]
                before = profile.before_connecting(spec, given.rounds)
                print(*profile.table("before the first connection", before), sep="\n")
                tables = network.within(
                    namespace, lambda: profiles(target, wanted[target.host], given.rounds)
                )
                for title, costs in tables.items():
                    print(*profile.table(title, costs), sep="\n")
                return 0
            rounds = network.within(namespace, lambda: measured(chosen, given.rounds))
        return int(not shown(chosen, rounds) and given.check)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    sys.exit(main())
