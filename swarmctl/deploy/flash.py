"""Writes firmwares to the boards of robots, by the agents on the robots' hosts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from swarm_onboard.agent.verbs import flash as flash_verb

from swarmctl.firmware import avrdude
from swarmctl.remote import agent_client, operators, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession, HostError, Session, Target, Transport

VERBS = ("flash",)
PATIENCE = 40.0  # s for the board to start, and to report to its driver
_TIMEOUT = 300.0  # s; the agent's own steps are bounded, and this is above their sum


@dataclass(frozen=True)
class Job:
    """What is written where: ``unit`` is the driver of ``robot``, ``port`` its line on ``host``."""

    swarm: str
    robot: str
    host: str
    unit: str
    port: str
    digest: str
    writing: avrdude.Writing


@dataclass(frozen=True)
class Flashed:
    """The board holds the firmware. ``runs``: its driver runs; ``reported``: it sent its digest."""

    runs: bool
    reported: bool


Results = Mapping[str, Flashed | HostError]
"""The results of the boards of one host, by robot."""


def flash(
    jobs: Iterable[Job],
    targets: Mapping[str, Target],
    transport: Transport,
    stop: parallel_hosts.Stop | None = None,
    *,
    parallel: int,
    stop_robots: bool = False,
) -> Iterator[parallel_hosts.Event[Results]]:
    """Write all boards: hosts in parallel, the boards of one host one after the other."""
    by_host: dict[str, list[Job]] = {}
    for job in jobs:
        by_host.setdefault(job.host, []).append(job)

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Results:
        with agent_client.agent_session(session, verbs=VERBS) as host:
            return {job.robot: _flashed(host, job, note, stop_robots) for job in by_host[target.host]}

    chosen = [targets[name] for name in by_host]
    return parallel_hosts.run(chosen, work, transport=transport, parallel=parallel, stop=stop)


def result_of(job: Job, of_host: Results | HostError) -> Flashed | HostError:
    """Returns the result of a job; an error of its host is its error, too."""
    return of_host if isinstance(of_host, HostError) else of_host[job.robot]


def _flashed(
    host: AgentSession, job: Job, note: Callable[[str], None], stop_robots: bool
) -> Flashed | HostError:
    files = job.writing.files
    request = flash_verb.Request(
        job.swarm,
        job.unit,
        job.port,
        [[name, len(content)] for name, content in files.items()],
        list(job.writing.command),
        job.digest,
        PATIENCE,
        who=operators.this_one(),
        stop_robots=stop_robots,
    )
    payload = b"".join(files.values())
    try:
        answer = ask(host, flash_verb.handle, request, payload, on_note=note, timeout=_TIMEOUT)
    except HostError as error:
        return error
    return Flashed(answer.runs, answer.logged)
