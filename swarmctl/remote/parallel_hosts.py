"""Runs a function on many hosts in parallel and yields events. A host's failure affects no other host."""

from __future__ import annotations

import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from types import FrameType
from typing import Any, Generic, TypeVar

from swarmctl.remote.transport import HostError, Kind, Session, Target, Transport

R = TypeVar("R")
R_co = TypeVar("R_co", covariant=True)
Work = Callable[[Session, Target, Callable[[str], None]], R]
"""The function to run on a host: gets its session, its target and a callback for notes on progress."""
WAKES = 0.5  # s until a wait of the main thread begins anew: a Ctrl-C just before one is seen after it


@dataclass(frozen=True)
class Started:
    """Work on a host has begun."""

    host: str


@dataclass(frozen=True)
class Note:
    """A note of the work on its progress."""

    host: str
    text: str


@dataclass(frozen=True)
class Finished(Generic[R_co]):
    """The work on a host ended, after ``seconds``, with a result or an error; 0 s if it never started."""

    host: str
    outcome: R_co | HostError
    seconds: float


Event = Started | Note | Finished[R]


_ABANDONED = HostError(
    Kind.STOPPED,
    "interrupted mid-deploy; the host finishes or rolls back on its own",
    "`swarmctl plan` shows the result",
)


def not_started(host: str) -> Finished[Any]:
    """Returns the event of a host whose work never starts, as the run was stopped before."""
    message = f"{host}: not started, the run was interrupted before"
    return Finished(host, HostError(Kind.STOPPED, message), 0.0)


def results_of(events: Iterable[Event[R]]) -> dict[str, R | HostError]:
    """Returns the result of each host, or its error, once all have one."""
    return {event.host: event.outcome for event in events if isinstance(event, Finished)}


@contextmanager
def bugs_as_errors(where: str) -> Iterator[None]:
    """Raises a ``HostError`` in place of any other exception: a bug in a thread costs its host only.

    With SWARMCTL_DEBUG the traceback goes to stderr.
    """
    try:
        yield
    except HostError:
        raise
    except (Exception, SystemExit) as error:
        if os.environ.get("SWARMCTL_DEBUG"):
            traceback.print_exc()
        message = f"{where}: {type(error).__name__}: {error}; this is a bug in swarmctl"
        raise HostError(Kind.BUG, message, "SWARMCTL_DEBUG=1 shows where it happened") from error


class Stop:
    """A request to end early: after the first, no more hosts start; the second closes the open sessions."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._requests = 0
        self._open: set[Session] = set()

    def request(self) -> None:
        """Request the end; safe between threads."""
        with self._lock:
            self._requests += 1
            cut = list(self._open) if self._requests > 1 else []
        for session in cut:
            session.close()

    @property
    def requested(self) -> bool:
        """True after the first request."""
        return self._requests > 0

    @property
    def cut(self) -> bool:
        """True after the second request: the sessions of running hosts were closed, too."""
        return self._requests > 1

    @contextmanager
    def guarding(self, session: Session) -> Iterator[None]:
        """Have ``session`` closed by the second request."""
        with self._lock:
            late = self._requests > 1
            self._open.add(session)
        try:
            if late:
                session.close()
            yield
        finally:
            with self._lock:
                self._open.discard(session)


@contextmanager
def interruptible(note: Callable[[str], None] = lambda _: None, stop: Stop | None = None) -> Iterator[Stop]:
    """Ctrl-C requests the returned ``Stop``; the third raises KeyboardInterrupt. In the main thread only."""
    stop = stop or Stop()
    presses = 0
    before = signal.getsignal(signal.SIGINT)

    def pressed(number: int, frame: FrameType | None) -> None:
        nonlocal presses
        presses += 1
        if presses > 2:
            raise KeyboardInterrupt
        if presses == 1:
            note("finishing the hosts in progress; after Ctrl-C again they finish or roll back on their own")
        # A thread of its own: the handler may have interrupted one that holds the lock.
        threading.Thread(target=stop.request, daemon=True).start()

    signal.signal(signal.SIGINT, pressed)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


def run(
    targets: Iterable[Target],
    work: Work[R],
    *,
    transport: Transport,
    parallel: int,
    stop: Stop | None = None,
) -> Iterator[Event[R]]:
    """Run ``work`` on every target over a connection of its own; see ``each``."""
    stop = stop or Stop()

    def connected(target: Target, note: Callable[[str], None]) -> R:
        with transport.connect(target) as session, stop.guarding(session):
            return work(session, target, note)

    return each(targets, connected, parallel=parallel, stop=stop)


def stream(
    targets: Iterable[Target],
    talk: Callable[[Session, Target], None],
    failed: Callable[[str, HostError], float | None],
    *,
    transport: Transport,
    stop: Stop | None = None,
) -> None:
    """Runs ``talk`` on every target, each in a thread of its own, and again over another connection after an
    error, until the process ends or ``stop`` is requested.

    ``failed`` takes the error of a host, and returns the s until its next connection; None if there is none.
    """
    ended = stop or Stop()

    def connected(target: Target) -> float | None:
        try:
            with bugs_as_errors(target.host), transport.connect(target) as session, ended.guarding(session):
                talk(session, target)
        except HostError as error:
            return failed(target.host, error)
        return 0.0

    def keep(target: Target) -> None:
        while not ended.requested and (pause := connected(target)) is not None:
            time.sleep(pause)

    for target in targets:
        threading.Thread(target=keep, args=(target,), daemon=True).start()


def each(
    targets: Iterable[Target],
    work: Callable[[Target, Callable[[str], None]], R],
    *,
    parallel: int,
    stop: Stop,
) -> Iterator[Event[R]]:
    """Run ``work`` for every target, with a callback for notes, for at most ``parallel`` at a time.

    Yields events as they happen; every target ends in exactly one ``Finished``.
    """
    waiting = list(targets)
    events: SimpleQueue[Event[R]] = SimpleQueue()
    pending: SimpleQueue[Target] = SimpleQueue()
    for target in waiting:
        pending.put(target)

    def worker() -> None:
        while True:
            try:
                target = pending.get_nowait()
            except Empty:
                return
            _run_on(target, work, stop, events.put)

    for _ in range(min(parallel, len(waiting))):
        threading.Thread(target=worker, daemon=True).start()
    left = len(waiting)
    try:
        while left:
            try:
                event = events.get(timeout=WAKES)
            except Empty:
                continue
            left -= isinstance(event, Finished)
            yield event
    finally:
        if left:  # the caller stopped reading
            stop.request()
            stop.request()


def _run_on(
    target: Target,
    work: Callable[[Target, Callable[[str], None]], R],
    stop: Stop,
    emit: Callable[[Event[R]], None],
) -> None:
    """Do the work for one host, and emit its events."""
    host = target.host
    if stop.requested:
        emit(not_started(host))
        return
    emit(Started(host))
    begun = time.monotonic()
    outcome: R | HostError
    try:
        with bugs_as_errors(host):
            outcome = work(target, lambda text: emit(Note(host, text)))
    except HostError as error:
        outcome = _ABANDONED if stop.cut and error.kind is not Kind.BUG else error
    emit(Finished(host, outcome, time.monotonic() - begun))
