"""Sessions in the processes of an executor: the operator's own process neither encrypts nor logs in.

Everything else stays with the operator: which hosts are next, events, leases, Ctrl-C. A worker that ends
loses its own sessions only; the others open the next ones.
"""

from __future__ import annotations

import pickle
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from swarmctl.remote import worker
from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.either_ssh import EitherSsh
from swarmctl.remote.lines import Line
from swarmctl.remote.transport import CHANNEL_TIMEOUT, HostError, Kind, Target, Transport
from swarmctl.remote.worker import Answered, Ask, BecomeRoot, Close, Connect, End, KeepAgent

LOGIN = 300.0  # s, more than the sum of the limits of a login through jump hosts
_MARGIN = 60.0  # s beyond the limit of a request in which its worker should report the end
_LOOK = 1.0  # s between two looks whether the workers are alive
_END = 10.0  # s in which a worker should end

Serve = Callable[[Callable[[], Transport], Line, Line], None]


@dataclass(frozen=True)
class Place:
    """Where one worker runs: an executor, a name for messages, and whether the worker is there still."""

    executor: Executor
    name: str
    alive: Callable[[], bool] = lambda: True


class Workers:
    """A transport whose sessions are spread over workers, one at each place. Use it as a context manager.

    ``login`` makes the transport of each worker there; ``line`` makes queues that reach them, and ``serve``
    is ``worker.serve`` or calls it. ``login`` and ``serve`` are pickled.
    """

    def __init__(
        self,
        places: Sequence[Place],
        line: Callable[[], Line],
        *,
        login: Callable[[], Transport] = EitherSsh,
        serve: Serve = worker.serve,
    ) -> None:
        self._lock = threading.Lock()
        self._numbers = count()
        self._sessions: dict[int, _Session] = {}
        self._reports = line()
        self._live = [_Worker(place, line(), self._reports, login, serve) for place in places]
        self._all = list(self._live)
        self._ended = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def processes(self) -> int:
        """How many processes have the sessions."""
        return len(self._all)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        for one in self._all:
            one.end()
        self._reader.join()
        for one in self._all:
            one.await_end()
        self._reports.close()

    @contextmanager
    def connect(self, target: Target) -> Iterator[_Session]:
        """Log in to a host from the worker with the fewest sessions. Raises ``HostError``."""
        session = self._opened(target)
        try:
            session.await_answer(LOGIN)
            yield session
        finally:
            session.close()
            with self._lock:
                self._sessions.pop(session.number, None)
                session.worker.sessions -= 1

    def _opened(self, target: Target) -> _Session:
        with self._lock:
            if not self._live:
                raise HostError(
                    Kind.UNREACHABLE,
                    f"{target.host} was not reached: no worker is left",
                    "start workers again, then run the same command again",
                )
            chosen = min(self._live, key=lambda one: one.sessions)
            chosen.sessions += 1
            session = _Session(next(self._numbers), target.host, chosen)
            self._sessions[session.number] = session
            chosen.send(Connect(session.number, _elsewhere(target)))
        return session

    def _read(self) -> None:
        """Passes reports on to the sessions, and looks after the workers."""
        looked = time.monotonic()
        while not self._ended.is_set():
            try:
                found = self._reports.get(_LOOK)
            except Exception as error:  # noqa: BLE001  (each kind of line has its own errors)
                self._lose(self._live, f"no worker can be reached any more ({error})")
                return
            for report in pickle.loads(found) if found else ():
                if session := self._sessions.get(report.number):
                    session.reports.put(report)
            if time.monotonic() > looked + _LOOK:
                self._lose([one for one in self._live if not one.alive], "it has ended")
                looked = time.monotonic()

    def _lose(self, lost: Sequence[_Worker], why: str) -> None:
        with self._lock:
            self._live = [one for one in self._live if one not in lost]
            cut = [one for one in self._sessions.values() if one.worker in lost]
        for one in lost:
            one.forget()
        for session in cut:
            session.lose(why)


def _elsewhere(target: Target) -> Target:
    """The target for another account: key files in the home of this one are those in the home of that one."""
    home = Path.home()
    keys = (
        Path("~", key.relative_to(home)) if key.is_relative_to(home) else key for key in target.identities
    )
    return replace(target, identities=tuple(keys), jump=target.jump and _elsewhere(target.jump))


class _Worker:
    """A worker at work. ``sessions``: how many it has."""

    def __init__(
        self, place: Place, orders: Line, reports: Line, login: Callable[[], Transport], serve: Serve
    ) -> None:
        self.name = place.name
        self.sessions = 0
        self._place = place
        self._orders = orders
        self._outgoing: SimpleQueue[Any] = SimpleQueue()
        self._knows: set[str] = set()
        self._lock = threading.Lock()
        self._task: Future[None] = place.executor.submit(serve, login, orders, reports)
        self._sender = threading.Thread(target=self._send, daemon=True)
        self._sender.start()

    @property
    def alive(self) -> bool:
        """True unless it has ended."""
        return not self._task.done() and self._place.alive()

    def send(self, order: worker.Order) -> None:
        """Sends an order."""
        self._outgoing.put(order)

    def send_agent(self, agent: Agent) -> None:
        """Sends an agent that it does not have yet."""
        with self._lock:
            if agent.digest not in self._knows:
                self._knows.add(agent.digest)
                self._outgoing.put(KeepAgent(agent))

    def end(self) -> None:
        """Has it end."""
        self._outgoing.put(End())
        self._outgoing.put(None)

    def await_end(self) -> None:
        """Waits until it has ended."""
        self._sender.join(_END)
        with suppress(Exception):  # the results of hosts do not depend on it
            self._task.result(timeout=_END)
        with suppress(Exception):
            self._orders.close()

    def forget(self) -> None:
        """Has it end if it lives, and not begin again if it does not."""
        self.end()
        self._task.cancel()

    def _send(self) -> None:
        with suppress(Exception):  # the line went with its worker; `alive` shows that
            worker.send(self._outgoing, self._orders, beat=worker.BEAT)


class _Session:
    """A session that a worker has; it is the conversation with the host, too."""

    def __init__(self, number: int, host: str, its_worker: _Worker) -> None:
        self.number = number
        self.worker = its_worker
        self.reports: SimpleQueue[worker.Report] = SimpleQueue()
        self._host = host
        self._ended: HostError | None = None

    def conversation(self, chosen: Agent, *, become: bool) -> _Conversation:
        """See ``WorkerSession``."""
        self.worker.send_agent(chosen)
        return _Conversation(self, chosen.digest, become)

    def become_root(self) -> None:
        """See ``WorkerSession``."""
        self.worker.send(BecomeRoot(self.number))
        self.await_answer(CHANNEL_TIMEOUT)

    def close(self) -> None:
        """See ``WorkerSession``."""
        self.worker.send(Close(self.number))
        self._end(HostError(Kind.LOST, f"the connection to {self._host} was closed"))

    def lose(self, why: str) -> None:
        """Ends it because its worker has ended."""
        self._end(
            HostError(
                Kind.LOST,
                f"the worker {self.worker.name} was lost while it was connected to {self._host}: {why}",
                "run the same command again",
            )
        )

    def await_answer(self, timeout: float, on_note: Callable[[str], None] | None = None) -> Any:
        """The answer to the last order. Raises ``HostError``."""
        if self._ended is not None:
            raise self._ended
        while True:
            try:
                report = self.reports.get(timeout=timeout + _MARGIN)
            except Empty:
                self.lose(f"it has reported nothing for {timeout + _MARGIN:.0f} s")
                continue
            if isinstance(report, Answered):
                break
            if on_note is not None:
                on_note(report.note)
        if isinstance(report.answer, HostError):
            raise self._from_there(report.answer)
        return report.answer

    def _end(self, error: HostError) -> None:
        self._ended = self._ended or error
        self.reports.put(Answered(self.number, error))

    def _from_there(self, error: HostError) -> HostError:
        """The error, with the worker if what went wrong may depend on it."""
        if error.kind is Kind.AUTH:
            hint = f"workers log in with their own keys and ssh-agent, not yours; there: {error.hint}"
            return HostError(error.kind, f"{error.message} (on worker {self.worker.name})", hint)
        if error.kind is Kind.UNREACHABLE:
            return HostError(error.kind, f"{error.message} (from worker {self.worker.name})", error.hint)
        return error


@dataclass(frozen=True)
class _Conversation:
    """A conversation that a worker has with the agent of this digest."""

    session: _Session
    agent: str
    become: bool

    def ask(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> Any:
        """See ``Conversation``."""
        session = self.session
        order = Ask(session.number, self.agent, self.become, dict(request), payload, timeout)
        session.worker.send(order)
        return session.await_answer(timeout, on_note)
