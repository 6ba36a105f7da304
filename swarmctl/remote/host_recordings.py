"""Records bags on hosts, and fetches them, over links that get lost."""

from __future__ import annotations

import hashlib
import math
import os
import re
import shlex
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from swarm_onboard.agent.bags import Recording
from swarm_onboard.agent.paths import BAGS
from swarm_onboard.agent.verbs import record, recording

from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.parallel_hosts import Event, Stop
from swarmctl.remote.transport import (
    ChannelSession,
    HostError,
    Kind,
    Session,
    Target,
    Transport,
    WorkerSession,
)
from swarmctl.resources import HostModule

_CHECKED_WITHIN = 900.0  # s in which a host reads a file for its checksum
_SHA256 = re.compile(rb"\\?([0-9a-f]{64}) .*\n(\d+)\n", re.DOTALL)
_PIECE = 1 << 20


def move(session: ChannelSession, path: str, place: Path, received: Callable[[int], None]) -> None:
    """Writes the file ``path`` of the host to ``place``, and removes it from the host.

    What has come is kept beside ``place`` until all has, and the next call goes on there. ``received`` gets
    how many bytes are here. A file at ``place`` that is the same stays. Raises ``HostError``.
    """
    digest, size = _digest_and_size(session, path)
    part = place.with_name(f".{place.name}.{digest[:12]}.part")
    with _writing(place):
        if place.exists():
            if _digest_here(place) != digest:
                raise HostError(
                    Kind.FAILED,
                    f"{place} exists, and is not that of the host",
                    "move it away, then fetch again",
                )
        else:
            _download(session, path, part, received)
            if part.stat().st_size < size:
                raise HostError(Kind.LOST, f"{path} came in part")
            if _digest_here(part) != digest:
                part.unlink()
                raise HostError(Kind.LOST, f"{path} was damaged on its way", "fetch it again")
            part.rename(place)
    _run(session, f"rm -- {shlex.quote(path)}")


def _digest_and_size(session: ChannelSession, path: str) -> tuple[str, int]:
    quoted = shlex.quote(path)
    found = _SHA256.fullmatch(_run(session, f"sha256sum -- {quoted} && stat -c %s -- {quoted}"))
    if found is None:
        raise HostError(Kind.PROTOCOL, "`sha256sum` printed no checksum", "is it the right host?")
    return found[1].decode(), int(found[2])


def _digest_here(place: Path) -> str:
    digest = hashlib.sha256()
    with place.open("rb") as file:
        while piece := file.read(_PIECE):
            digest.update(piece)
    return digest.hexdigest()


def _download(session: ChannelSession, path: str, part: Path, received: Callable[[int], None]) -> None:
    with part.open("ab") as file:
        here = os.fstat(file.fileno()).st_size
        line = f"tail -c +{here + 1} -- {shlex.quote(path)}"
        with session.channel(_portable(line), limit=1 << 30) as channel:
            status, complaint = None, b""
            while status is None:
                piece = channel.more()
                file.write(piece.stdout)
                complaint += piece.stderr
                here += len(piece.stdout)
                received(here)
                status = piece.status
        if status:
            raise _failed(line, status, complaint)
        file.flush()
        os.fsync(file.fileno())


def _run(session: ChannelSession, line: str) -> bytes:
    with session.channel(_portable(line)) as channel:
        done = channel.exchange([], lambda _: False, timeout=_CHECKED_WITHIN)
    if done.status:
        raise _failed(line, done.status, done.stderr)
    return done.stdout


def _portable(line: str) -> str:
    """``line`` for any login shell."""
    return f"exec /bin/sh -c {shlex.quote(line)}"


def _failed(line: str, status: int, complaint: bytes) -> HostError:
    text = complaint.decode("utf-8", "replace").strip().rpartition("\n")[2]
    return HostError(Kind.FAILED, f"`{line}` failed: {text or f'exit code {status}'}"[:300])


@contextmanager
def _writing(place: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise HostError(Kind.FAILED, f"{place} cannot be written: {error.strerror}") from error


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
            move(session, f"{BAGS}/{swarm}/{name}", place, received)
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
