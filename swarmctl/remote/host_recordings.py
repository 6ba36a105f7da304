"""Records bags on hosts, and fetches them, over links that get lost."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from swarm_onboard.agent.bags import Recording
from swarm_onboard.agent.paths import BAGS
from swarm_onboard.agent.verbs import record, recording

from swarmctl.remote import agent_client, file_download, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Event, Stop
from swarmctl.remote.transport import HostError, Session, Target, Transport, WorkerSession
from swarmctl.resources import HostModule

R = TypeVar("R")
_LOOK = 1.0  # s
_STARTS_WITHIN, _STOPS_WITHIN = 60.0, 120.0  # s
_PAUSES = (1.0, 2.0, 4.0, 8.0, 10.0)  # s before a host is connected again, after which nothing has come
_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,200}\.(bag|mcap)(\.active)?")


@dataclass
class Fetched:
    """What a host had: its last recording, and its bags, which are here now, with their sizes in bytes."""

    host: str
    recording: Recording | None = None
    bags: dict[Path, int] = field(default_factory=dict)


def start(
    requests: Mapping[str, record.Request],
    targets: Sequence[Target],
    modules: Mapping[str, HostModule],
    transport: Transport,
    *,
    parallel: int,
) -> Generator[Event[Recording], None, None]:
    """Starts a recording on each host that publishes something of it; others answer without topics.

    ``modules``: those that look at the graph, by host.
    """

    def work(session: Session, target: Target, note: object) -> Recording:
        with agent_client.agent_session(session, verbs=("record",), module=modules[target.host]) as agent:
            return ask(agent, record.handle, requests[target.host], timeout=_STARTS_WITHIN)

    yield from parallel_hosts.run(targets, work, transport=transport, parallel=parallel)


def watch(
    swarm: str, targets: Sequence[Target], transport: Transport
) -> Generator[Event[Recording], None, None]:
    """Watches recordings until they end; each second a note has the bytes in the bags of a host.

    A host whose link is lost is connected again; what keeps it away is a note.
    """
    stop = Stop()

    def work(target: Target, note: Callable[[str], None]) -> Recording:
        def look(session: Session) -> Recording:
            with agent_client.agent_session(session, verbs=("recording",)) as agent:
                while True:
                    answer = ask(agent, recording.handle, recording.Request(swarm))
                    if not answer.runs:
                        return answer
                    note(str(sum(answer.bags.values())))
                    time.sleep(_LOOK)

        return _over_lost_links(look, target, transport, stop, note)

    yield from parallel_hosts.each(targets, work, parallel=len(targets), stop=stop)


def fetch(
    swarm: str, targets: Sequence[Target], transport: Transport, folder: Path, *, parallel: int
) -> Generator[Event[Fetched], None, None]:
    """Ends recordings, and moves the bags of the hosts to ``folder``; notes are as those of ``watch``.

    After a lost link it goes on where it broke off; an error is the sixth in a row without a new byte.
    """
    stop = Stop()

    def work(target: Target, note: Callable[[str], None]) -> Fetched:
        found = Fetched(target.host)
        here = 0

        def received(count: int) -> None:
            nonlocal here
            here = sum(found.bags.values()) + count
            note(str(here))

        def move(session: Session) -> Fetched:
            _move_all(swarm, session, folder, found, received)
            return found

        return _over_lost_links(move, target, transport, stop, note, progress=lambda: here, most=len(_PAUSES))

    yield from parallel_hosts.each(targets, work, parallel=parallel, stop=stop)


def _move_all(
    swarm: str, session: Session, folder: Path, found: Fetched, received: Callable[[int], None]
) -> None:
    assert not isinstance(session, WorkerSession)
    with agent_client.agent_session(session, verbs=("recording",)) as agent:
        answer = ask(agent, recording.handle, recording.Request(swarm, stop=True), timeout=_STOPS_WITHIN)
    found.recording = found.recording or answer
    for name, size in sorted(answer.bags.items()):
        if _NAME.fullmatch(name):
            place = folder / name
            file_download.move(session, f"{BAGS}/{swarm}/{name}", place, received)
            found.bags[place] = size
            received(0)


def _over_lost_links(
    use: Callable[[Session], R],
    target: Target,
    transport: Transport,
    stop: Stop,
    note: Callable[[str], None],
    *,
    progress: Callable[[], int] = lambda: 0,
    most: float = math.inf,
) -> R:
    """What ``use`` returns. It is called again after an error that may pass, ``most`` times in vain."""
    failures, before = 0, progress()
    while True:
        try:
            with transport.connect(target) as session, stop.guarding(session):
                return use(session)
        except HostError as error:
            failures = 1 if progress() > before else failures + 1
            before = progress()
            if not error.retryable or failures > most or stop.requested:
                raise
            note(error.message)
        time.sleep(_PAUSES[min(failures, len(_PAUSES)) - 1])
