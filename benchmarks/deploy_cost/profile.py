"""Where the time goes: on the operator's machine, and with one host, alone."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path

from deploy_cost.steps import Steps
from swarmctl.deploy.observe_host import observe_host
from swarmctl.remote import agent_client
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.transport import AgentSession, HostError, Session, Target
from swarmctl.render.bundle import Bundle

FLOOR = "floor: two connections, one fsync"
_SYNCED = "dd if=/dev/zero of=.swarm-bench bs=4096 count=1 conv=fsync status=none && rm .swarm-bench"
Costs = dict[str, tuple[float, float]]  # by step: s of wall time, s of the operator's CPU time

#: What a process of swarmctl does before it connects. It prints its steps as JSON.
_START = """
import json, sys, time
from pathlib import Path
steps, began = {}, [time.perf_counter(), time.process_time()]
def done(name):
    now = [time.perf_counter(), time.process_time()]
    steps[name] = (now[0] - began[0], now[1] - began[1])
    began[:] = now
from swarmctl.cli.app import run
from swarmctl.cli import console, options
done("import the command line")
from tests.loading import load_checked
done("import the rules")
from swarmctl.analysis.impact import impacts
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.resolve import resolve
done("import resolve, render")
from swarmctl.deploy.deployment import Deployment
from swarmctl.remote.ssh import SshTransport
done("import deploy, paramiko")
document, _ = load_checked(Path(sys.argv[1]))
done("read and check the spec")
swarm = resolve(document)
done("resolve")
wanted = bundles(swarm)
for one in wanted.values():
    one.digest
done("render, digests")
print(json.dumps(steps))
"""


def before_connecting(spec: Path, rounds: int) -> Costs:
    """The steps of a process before its first connection; a first run, which may compile, is not counted."""
    found = [
        json.loads(
            subprocess.run(
                [sys.executable, "-c", _START, str(spec)], stdout=subprocess.PIPE, check=True
            ).stdout
        )
        for _ in range(rounds + 1)
    ][1:]
    return {"start Python": _python(rounds), **_medians(found)}


def _python(rounds: int) -> tuple[float, float]:
    walls = []
    for _ in range(rounds):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-I", "-c", "pass"], check=True)
        walls.append(time.perf_counter() - began)
    return statistics.median(walls), statistics.median(walls)


def on_a_host(target: Target, bundle: Bundle, rounds: int) -> Costs:
    """The steps with one host, alone; a first round to warm up is not counted."""
    return _medians([dict(_round(target, bundle)) for _ in range(rounds + 1)][1:])


def _round(target: Target, bundle: Bundle) -> Iterator[tuple[str, tuple[float, float]]]:
    transport = SshTransport()
    exchange = _cost(lambda: transport.scan(target))
    yield "TCP, SSH key exchange", exchange
    with ExitStack() as open_until_end:
        wall, cpu = time.perf_counter(), time.process_time()
        session = open_until_end.enter_context(transport.connect(target))
        whole = time.perf_counter() - wall, time.process_time() - cpu
        yield "login", _less(whole, exchange)
        true = _cost(lambda: _run(session, "true"))
        yield "a channel, `true`", true
        python = _cost(lambda: _run(session, "python3 -I -S -c pass"))
        yield "start Python", _less(python, true)
        with agent_client.agent_session(session) as host:
            yield "start the agent", _less(_cost(lambda: start_agent(host)), python)
            yield "first `observe`", _cost(lambda: observe_host(host, bundle))
            yield "second `observe`", _cost(lambda: observe_host(host, bundle))


def of_a_deploy(deploy: Callable[[Steps], None], rounds: int) -> Costs:
    """The steps of ``deploy`` with one host, over its argument; a first round is not counted."""
    found = []
    for _ in range(rounds + 1):
        steps = Steps()
        wall, cpu = time.perf_counter(), time.process_time()
        deploy(steps)
        whole = time.perf_counter() - wall, time.process_time() - cpu
        costs: Costs = {}
        for name, *cost in steps.taken:
            number = sum(name == known.partition(" (")[0] for known in costs)
            costs[f"{name} ({number + 1})" if number else name] = (cost[0], cost[1])
        inside = (sum(one[part] for one in costs.values()) for part in (0, 1))
        costs["swarmctl between these steps"] = _less(whole, (next(inside), next(inside)))
        found.append(costs)
    return _medians(found[1:])


def floor(target: Target, log_in: Callable[[], None], rounds: int) -> Costs:
    """What nobody can do without who confirms over a new connection what has reached the disk."""
    found = []
    for _ in range(rounds + 1):
        first, again = _cost(log_in), _cost(log_in)
        with SshTransport().connect(target) as session:
            true = _cost(lambda: _run(session, "true"))
            fsync = _less(_cost(lambda: _run(session, _SYNCED)), true)
        found.append(
            {"connect, login, `true`": first, "the same over a new connection": again, "fsync": fsync}
        )
    return _medians(found[1:])


def _run(session: Session, command: str) -> None:
    with session.channel(command) as channel:
        channel.exchange([], lambda _: False, timeout=30)


def start_agent(host: AgentSession) -> None:
    """Starts the agent with the shortest request: one that it refuses."""
    with suppress(HostError):
        host.request({"verb": "no verb"})


def _cost(work: Callable[[], object]) -> tuple[float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - cpu


def _less(whole: tuple[float, float], part: tuple[float, float]) -> tuple[float, float]:
    return max(0.0, whole[0] - part[0]), max(0.0, whole[1] - part[1])


def _medians(rounds: Sequence[Mapping[str, tuple[float, float]]]) -> Costs:
    def median(name: str, part: int) -> float:
        return statistics.median(one[name][part] for one in rounds)

    return {name: (median(name, 0), median(name, 1)) for name in rounds[0]}


def table(title: str, costs: Costs) -> Iterator[str]:
    """Lines with each step in ms, and the sum."""
    yield f"{title:34}{'ms':>8}{'of it CPU here':>16}"
    for name, (wall, cpu) in costs.items():
        yield f"  {name:32}{1e3 * wall:8.1f}{1e3 * cpu:16.1f}"
    wall, cpu = (sum(one[part] for one in costs.values()) for part in (0, 1))
    yield f"  {'all':32}{1e3 * wall:8.1f}{1e3 * cpu:16.1f}"
