"""Many hosts at once: each ends in one event, and whatever happens to one costs only that one."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from swarmctl.remote import parallel_hosts
from swarmctl.remote.parallel_hosts import (
    Finished,
    Note,
    Started,
    Stop,
)
from swarmctl.remote.transport import HostError, Kind, Output, Session, Target
from tests.timing import PATIENCE, wait_for

Notify = Callable[[str], None]


class EchoChannel:
    def __init__(self, command: str) -> None:
        self._command = command

    def exchange(self, *_: object, **__: object) -> Output:
        return Output(0, self._command.encode(), b"")


class FakeSession:
    def __init__(self) -> None:
        self.closed = threading.Event()

    @contextmanager
    def channel(self, command: str, *, limit: int = 0) -> Iterator[EchoChannel]:
        yield EchoChannel(command)

    def close(self) -> None:
        self.closed.set()


class FakeTransport:
    """Lets everyone in but the hosts called dead."""

    def __init__(self) -> None:
        self.now = 0
        self.most = 0
        self._lock = threading.Lock()

    @contextmanager
    def connect(self, target: Target) -> Iterator[FakeSession]:
        if target.host.startswith("dead"):
            raise HostError(Kind.UNREACHABLE, f"{target.host} is dead")
        with self._lock:
            self.now += 1
            self.most = max(self.most, self.now)
        try:
            yield FakeSession()
        finally:
            with self._lock:
                self.now -= 1


def targets(*names: str) -> list[Target]:
    return [Target(name, "127.0.0.1", "root") for name in names]


def echo(session: Session, target: Target, notify: Notify) -> bytes:
    notify("at it")
    with session.channel(target.host) as channel:
        return channel.exchange((), lambda piece: False).stdout


def test_events_of_each_host_are_in_order() -> None:
    events = list(parallel_hosts.run(targets("a", "b"), echo, transport=FakeTransport(), parallel=4))

    for name in "ab":
        mine = [event for event in events if event.host == name]
        assert mine[:2] == [Started(name), Note(name, "at it")]
        assert isinstance(mine[2], Finished)
        assert mine[2].outcome == name.encode()
        assert len(mine) == 3


def test_a_dead_host_and_a_bug_cost_only_themselves() -> None:
    def work(session: Session, target: Target, notify: Notify) -> bytes:
        if target.host == "buggy":
            raise KeyError("x")
        if target.host == "quitter":
            raise SystemExit(3)
        return echo(session, target, notify)

    names = ("dead1", "a", "buggy", "b", "quitter")
    events = parallel_hosts.run(targets(*names), work, transport=FakeTransport(), parallel=4)
    ended = {event.host: event.outcome for event in events if isinstance(event, Finished)}

    assert (ended["a"], ended["b"]) == (b"a", b"b")
    assert ended["dead1"] == HostError(Kind.UNREACHABLE, "dead1 is dead")
    assert str(ended["buggy"]) == "buggy: KeyError: 'x'; this is a bug in swarmctl"
    assert isinstance(ended["quitter"], HostError)
    assert ended["quitter"].kind is Kind.BUG


def test_the_traceback_of_a_bug_is_for_debugging(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def traceback() -> str:
        with pytest.raises(HostError), parallel_hosts.bugs_as_errors("a"):
            raise KeyError("x")
        return capsys.readouterr().err

    assert traceback() == ""
    monkeypatch.setenv("SWARMCTL_DEBUG", "1")
    assert traceback().startswith("Traceback")


def test_no_more_than_so_many_at_once() -> None:
    transport = FakeTransport()
    eight = threading.Barrier(8)

    def work(session: Session, target: Target, notify: Notify) -> None:
        eight.wait(PATIENCE)
        time.sleep(0.01)  # a ninth would come in meanwhile

    events = list(
        parallel_hosts.run(targets(*(f"h{n}" for n in range(40))), work, transport=transport, parallel=8)
    )

    assert transport.most == 8
    assert Counter(type(event) for event in events) == {Started: 40, Finished: 40}
    assert not [event for event in events if isinstance(event, Finished) and event.outcome is not None]


def test_many_hosts_are_worked_on_at_once() -> None:
    """None is done before work on all has begun."""
    all_of_them = threading.Barrier(50)

    def work(session: Session, target: Target, notify: Notify) -> None:
        all_of_them.wait(PATIENCE)

    events = parallel_hosts.run(
        targets(*(f"h{n}" for n in range(50))), work, transport=FakeTransport(), parallel=50
    )
    assert [event.outcome for event in events if isinstance(event, Finished)] == [None] * 50


def test_no_hosts_is_no_events() -> None:
    assert list(parallel_hosts.run([], echo, transport=FakeTransport(), parallel=4)) == []


def test_the_first_stop_lets_running_hosts_finish_and_starts_no_more() -> None:
    stop = Stop()

    def work(session: Session, target: Target, notify: Notify) -> bytes:
        stop.request()
        return b"done"

    events = list(
        parallel_hosts.run(targets("a", "b", "c"), work, transport=FakeTransport(), stop=stop, parallel=1)
    )

    first, *others = (event for event in events if isinstance(event, Finished))
    assert first.outcome == b"done"
    assert others == [parallel_hosts.not_started("b"), parallel_hosts.not_started("c")]


def test_the_second_stop_cuts_the_running_hosts_off() -> None:
    stop = Stop()

    def work(session: Session, target: Target, notify: Notify) -> None:
        assert isinstance(session, FakeSession)
        if not session.closed.wait(PATIENCE):
            raise AssertionError("nobody closed the session")
        raise HostError(Kind.LOST, "cut off")

    events = parallel_hosts.run(targets("a", "b"), work, transport=FakeTransport(), stop=stop, parallel=4)
    begun = [next(events), next(events)]
    assert {type(event) for event in begun} == {Started}
    stop.request()
    stop.request()
    assert [event.outcome.kind for event in events] == [Kind.STOPPED, Kind.STOPPED]  # type: ignore[union-attr]


def test_when_nobody_listens_any_more_everything_ends() -> None:
    ended = threading.Semaphore(0)

    def work(session: Session, target: Target, notify: Notify) -> None:
        assert isinstance(session, FakeSession)
        session.closed.wait(PATIENCE)
        ended.release()

    events = parallel_hosts.run(targets("a", "b"), work, transport=FakeTransport(), parallel=1)
    next(events)
    time.sleep(0.05)
    events.close()  # type: ignore[attr-defined]
    assert ended.acquire(timeout=PATIENCE)
    assert not ended.acquire(timeout=0.2), "a host was begun after the end"


def test_ctrl_c_sets_the_stop_and_its_handler_is_restored() -> None:
    before = signal.getsignal(signal.SIGINT)
    with parallel_hosts.interruptible() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        wait_for(lambda: stop.requested)
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


class Interrupted(Exception):  # noqa: N818  (KeyboardInterrupt would end pytest)
    """What a handler raises."""


def test_a_signal_just_before_a_wait_interrupts_it() -> None:
    """As one that another thread receives: the wait itself goes on."""

    def interrupt(*_: object) -> None:
        raise Interrupted

    def work(session: Session, target: Target, notify: Notify) -> None:
        assert isinstance(session, FakeSession)
        time.sleep(0.05)
        signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)
        if not session.closed.wait(PATIENCE):
            overdue.append(target.host)

    overdue: list[str] = []
    before = signal.signal(signal.SIGUSR1, interrupt)
    try:
        with pytest.raises(Interrupted):
            list(parallel_hosts.run(targets("a"), work, transport=FakeTransport(), parallel=1))
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert overdue == []
