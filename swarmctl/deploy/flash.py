"""Writes firmwares to the boards of robots, by the agents on the robots' hosts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from swarmctl.firmware import avrdude
from swarmctl.remote import agent, fleet
from swarmctl.remote.transport import HostError, Session, Target, Transport

VERBS = ("flash",)
PATIENCE = 40.0  # s for the board to start, and its driver to hear from it
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
    """The board holds the firmware. ``runs``: its driver does; ``told``: and has heard the board say so."""

    runs: bool
    told: bool


Results = Mapping[str, Flashed | HostError]
"""What became of the boards of one host, by robot."""


def flash(
    jobs: Iterable[Job], targets: Mapping[str, Target], transport: Transport, stop: fleet.Stop | None = None
) -> Iterator[fleet.Event[Results]]:
    """Write them all: hosts side by side, the boards of one host one after the other."""
    by_host: dict[str, list[Job]] = {}
    for job in jobs:
        by_host.setdefault(job.host, []).append(job)

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Results:
        with agent.talk(session, verbs=VERBS) as host:
            return {job.robot: _flashed(host, job, note) for job in by_host[target.host]}

    return fleet.run((targets[name] for name in by_host), work, transport=transport, stop=stop)


def result_of(job: Job, of_host: Results | HostError) -> Flashed | HostError:
    """What became of a job; what befell its host befell it too."""
    return of_host if isinstance(of_host, HostError) else of_host[job.robot]


def _flashed(host: agent.Conversation, job: Job, note: Callable[[str], None]) -> Flashed | HostError:
    files = job.writing.files
    request = {
        "verb": "flash",
        "swarm": job.swarm,
        "who": agent.operator(),
        "unit": job.unit,
        "port": job.port,
        "files": [(name, len(content)) for name, content in files.items()],
        "write": job.writing.command,
        "digest": job.digest,
        "patience": PATIENCE,
    }
    try:
        answer = host.ask(request, b"".join(files.values()), on_note=note, timeout=_TIMEOUT)
    except HostError as error:
        return error
    return Flashed(bool(answer["runs"]), bool(answer["told"]))
