"""What a host of a large fleet costs the operator: ``python benchmarks/scale.py [--hosts N] [--check]``.

`swarmctl plan` of N recorded hosts: SSH servers on this machine that replay what one agent answered. First
with all connections in one process, then in the workers of a Dask cluster, each a process as on a machine of
its own. CPU time per host of the operator, of the workers with their scheduler, and of the recorded hosts,
which are none of the operator's; the most memory of the operator.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from validate import EACH, spec_of

from swarmctl.deploy.rollout import observe
from swarmctl.plan.plan import Plan
from swarmctl.remote import dask_cluster
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import Target, Transport
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests.loading import load_swarm
from tests.onboard.agent.fakehost import FakeHost
from tests.remote import recorded_hosts

BAR = 2.5  # times less of the operator's CPU time with workers
_TICK = os.sysconf("SC_CLK_TCK")
_START = 60.0  # s


@dataclass(frozen=True)
class Cost:
    """CPU time by part of the work and the time that passed, in s; the most memory, in MB."""

    operator: float
    workers: float
    hosts: float
    passed: float
    memory: float


def cpu(pids: Sequence[int]) -> float:
    """The CPU time of processes so far, in s."""
    fields = (Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split() for pid in pids)
    return sum(int(one[11]) + int(one[12]) for one in fields) / _TICK


def most_memory() -> float:
    """The most that this process has had in memory since ``forget_memory``, in MB (proc(5))."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1000


def forget_memory() -> None:
    Path("/proc/self/clear_refs").write_text("5")


def rendered(hosts: int, folder: Path) -> dict[str, Bundle]:
    spec = folder / "swarm.yaml"
    spec.write_text(spec_of("leader", hosts * EACH), "utf-8")
    swarm, _ = load_swarm(spec)
    assert swarm is not None
    return dict(list(bundles(swarm).items())[:hosts])


def recorded(wanted: Mapping[str, Bundle], folder: Path) -> dict[str, object]:
    """What an agent answers to `plan`: its host has everything, and the release that the request names."""
    needs = {need for bundle in wanted.values() for need in (*bundle.asks, *bundle.wants)}
    answer = FakeHost(folder / "host").observe()
    facts = answer.facts._replace(has=dict.fromkeys(sorted(needs), "/usr/bin/true"))
    return answer._replace(facts=facts, release=None)._asdict()


@contextmanager
def cluster(workers: int, folder: Path) -> Iterator[tuple[str, tuple[int, ...]]]:
    """A scheduler and its workers, in processes of their own: the address and the process ids."""
    file = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    common = ["--no-dashboard", "--scheduler-file", str(file)]
    quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    worker = [*dask, "worker", "--nthreads", "1", "--no-nanny", "--memory-limit", "0", *common]
    with ExitStack() as ending:

        def started(argv: list[str]) -> int:
            process = subprocess.Popen(argv, cwd=folder, **quiet)  # type: ignore[call-overload]
            ending.callback(process.wait)
            ending.callback(process.terminate)
            return int(process.pid)

        pids = [started([*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *common])]
        end = time.monotonic() + _START
        while not file.exists():
            if time.monotonic() > end:
                raise SystemExit("the Dask scheduler does not start")
            time.sleep(0.05)
        pids += [started([*worker, "--host", "127.0.0.1"]) for _ in range(workers)]
        address = json.loads(file.read_text())["address"]
        import distributed

        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=_START)
        yield address.replace("tcp", "dask"), tuple(pids)


def measured(
    wanted: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    parallel: int,
    *,
    workers: Sequence[int],
    hosts: Sequence[int],
) -> tuple[Plan, Cost]:
    forget_memory()
    before = time.process_time(), cpu(workers), cpu(hosts), time.monotonic()
    plan = observe(wanted, targets, transport, parallel=parallel)
    after = time.process_time(), cpu(workers), cpu(hosts), time.monotonic()
    return plan, Cost(*(one - two for one, two in zip(after, before, strict=True)), memory=most_memory())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--hosts", type=int, default=2000)
    parser.add_argument("--workers", type=int, default=4)
    parser.add_argument("--parallel", type=int, default=64, help="connections at a time")
    parser.add_argument("--check", action="store_true", help="fail below the bar")
    given = parser.parse_args()
    costs: dict[str, Cost] = {}
    plans = []
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as name:
        folder = Path(name)
        wanted = rendered(given.hosts, folder)
        answer = recorded(wanted, folder)
        with recorded_hosts.running(folder, {"observe": answer}, 2) as hosts:
            targets = {host: hosts.target(host) for host in wanted}
            warm = dict(list(wanted.items())[:8])

            def run(label: str, transport: Transport, workers: Sequence[int] = ()) -> None:
                observe(warm, targets, transport, parallel=4)  # imports, the agent's archive
                plan, cost = measured(
                    wanted, targets, transport, given.parallel, workers=workers, hosts=hosts.pids
                )
                if wrong := [one for one in plan.hosts if one.problem]:
                    raise SystemExit(f"{label}: {len(wrong)} hosts failed, such as {wrong[0].problem}")
                costs[label] = cost
                plans.append(plan)

            run("one process", SshTransport())
            with (
                cluster(given.workers, folder) as (address, pids),
                dask_cluster.workers(dask_cluster.address_of(address)) as transport,
            ):
                run(f"{given.workers} workers", transport, pids)
    if plans[0] != plans[1]:
        raise SystemExit("the two plans differ")
    return report(costs, given.hosts, check=given.check)


def report(costs: Mapping[str, Cost], hosts: int, *, check: bool) -> int:
    print(f"plan of {hosts} recorded hosts on {os.cpu_count()} cores; CPU time per host, ms")
    print(f"{'':14}{'operator':>9}{'workers':>9}{'hosts':>7}{'s in all':>10}{'ms per host':>13}{'MB':>6}")
    for label, one in costs.items():
        parts = [1000 * part / hosts for part in (one.operator, one.workers, one.hosts)]
        print(f"{label:14}{parts[0]:9.2f}{parts[1]:9.2f}{parts[2]:7.2f}{one.passed:10.1f}"
              f"{1000 * one.passed / hosts:13.2f}{one.memory:6.0f}")  # fmt: skip
    alone, spread = costs.values()
    ratio = alone.operator / spread.operator
    faster, cores = alone.passed / spread.passed, os.cpu_count()
    verdict = "PASS" if ratio >= BAR else "FAIL"
    print(f"{verdict}: the operator's CPU time per host is {ratio:.1f} times less with workers "
          f"(bar {BAR:g}), and all took {faster:.2f} times less.")  # fmt: skip
    print(f"Operator, workers and hosts share {cores} cores, so the latter is at most {cores}; "
          "workers on machines of their own have no such bound.")  # fmt: skip
    return int(check and ratio < BAR)


if __name__ == "__main__":
    sys.exit(main())
