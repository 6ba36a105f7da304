"""Sessions in other processes: hosts, events and Ctrl-C are as without, and a lost worker costs its own."""

from __future__ import annotations

import multiprocessing
import os
import queue
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from swarmctl.remote import agent_client, connections, parallel_hosts, worker
from swarmctl.remote.lines import QueueLine
from swarmctl.remote.parallel_hosts import Finished, Note, Skipped, Started, Stop
from swarmctl.remote.transport import HostError, Kind, Output, Session, Target
from swarmctl.remote.workers import Place, Workers
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import HOSTS, TARGETS, FolderTransport, bundles, changed, deployed, hosts
from tests.onboard.agent.fakehost import FakeHost
from tests.timing import PATIENCE, wait_for

__all__ = ["hosts"]


class Agentless:
    """A host whose agent notes its process, then answers; one called silent answers when it is closed."""

    def __init__(self, host: str) -> None:
        self._host = host
        self._closed = threading.Event()

    @contextmanager
    def channel(self, command: str, *, limit: int = 0) -> Iterator[Agentless]:
        self._mark = f"@{command.split()[command.split().index('sh', 3) + 1]} "
        yield self

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        enough(f'{self._mark}{{"note": "in process {os.getpid()}"}}\n'.encode())
        if self._host.startswith("silent"):
            assert self._closed.wait(PATIENCE)
            raise HostError(Kind.LOST, "closed")
        enough(f'{self._mark}{{"answer": {{"host": "{self._host}"}}}}\n'.encode())
        return Output(None, b"", b"")

    def close(self) -> None:
        self._closed.set()


class Hosts:
    """Leads to hosts without an agent; logs in to none that is called locked."""

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        if target.host == "locked":
            raise HostError(Kind.AUTH, "locked rejected the login", "use another key")
        if target.host == "buggy":
            raise KeyError("x")
        yield Agentless(target.host)


def targets(*names: str) -> list[Target]:
    return [Target(name, "192.0.2.1", "root") for name in names]


def question(session: Session, target: Target, note: Callable[[str], None]) -> Any:
    with agent_client.talk(session) as host:
        return host.ask({"verb": "test"}, on_note=note)


@contextmanager
def in_threads(
    count: int = 2, alive: Callable[[int], bool] = lambda _: True, login: Callable[[], Any] = Hosts
) -> Iterator[Workers]:
    with ThreadPoolExecutor(count) as pool:
        places = [Place(pool, f"worker-{n}", partial(alive, n)) for n in range(count)]
        with Workers(places, lambda: QueueLine(queue.Queue()), login=login) as workers:
            yield workers


def outcomes(events: Iterator[Any]) -> dict[str, Any]:
    return {event.host: event.outcome for event in events if isinstance(event, Finished)}


def test_a_whole_deploy_is_as_without_workers(hosts: dict[str, FakeHost]) -> None:
    with in_threads(login=partial(FolderTransport, hosts, {})) as workers:
        assert changed(deployed(deploy(bundles(), TARGETS, workers))) == dict.fromkeys(HOSTS, True)
        assert changed(deployed(deploy(bundles(), TARGETS, workers))) == dict.fromkeys(HOSTS, False)
        again = deployed(deploy(bundles(k3="speed: 2\n"), TARGETS, workers, consistency="all"))
    assert changed(again) == {"leader": False, "k3": True, "epuck": False}
    assert hosts["k3"].read("opt/swarm/new/current/params/robot.yaml") == b"speed: 2\n"


def test_a_host_that_fails_in_a_worker_costs_only_itself() -> None:
    with in_threads() as workers:
        found = outcomes(
            parallel_hosts.run(targets("locked", "buggy", "a", "b"), question, transport=workers, parallel=4)
        )
    assert (found["a"], found["b"]) == ({"host": "a"}, {"host": "b"})
    assert found["locked"].kind is Kind.AUTH
    assert "locked rejected the login (on worker worker-" in found["locked"].message
    assert found["locked"].hint.startswith("workers log in with their own keys")
    assert found["buggy"] == HostError(Kind.BUG, "KeyError: 'x'")


def test_processes_of_the_standard_library_are_workers() -> None:
    context = multiprocessing.get_context("forkserver")
    with context.Manager() as manager, ProcessPoolExecutor(2, context) as pool:
        places = [Place(pool, f"process {n}") for n in range(2)]
        with Workers(places, lambda: QueueLine(manager.Queue()), login=Hosts) as workers:
            names = [f"h{n}" for n in range(8)]
            events = list(parallel_hosts.run(targets(*names), question, transport=workers, parallel=4))
    for name in names:
        mine = [event for event in events if event.host == name]
        assert [type(event) for event in mine] == [Started, Note, Finished]
        assert mine[2].outcome == {"host": name}  # type: ignore[union-attr]
    notes = {event.text for event in events if isinstance(event, Note)}
    assert len(notes) == 2, "the hosts are spread over both"
    assert f"in process {os.getpid()}" not in notes


def test_a_lost_worker_costs_its_hosts_and_the_others_go_on() -> None:
    lost: set[int] = set()
    with in_threads(2, lambda n: n not in lost) as workers:
        events = parallel_hosts.run(
            targets("silent1", "silent2", "a", "b"), question, transport=workers, parallel=2
        )
        for _ in range(4):  # both have begun, and each has sent a note
            next(events)
        lost.add(0)
        first = next(event for event in events if isinstance(event, Finished))
        assert isinstance(first.outcome, HostError)
        assert first.outcome.kind is Kind.LOST
        assert f"the worker worker-0 was lost while it was connected to {first.host}" in first.outcome.message
        found = [next(event for event in events if isinstance(event, Finished)) for _ in range(2)]
        assert [one.outcome for one in found] == [{"host": "a"}, {"host": "b"}]
        lost.add(1)
        assert len(outcomes(events)) == 1
        none = outcomes(parallel_hosts.run(targets("c"), question, transport=workers, parallel=4))["c"]
        assert str(none) == "c was not reached: no worker is left"


def test_a_worker_keeps_no_session_that_the_operator_has_ended() -> None:
    opened: list[str] = []
    ended: list[str] = []

    class Counting(Hosts):
        @contextmanager
        def connect(self, target: Target) -> Iterator[Session]:
            with super().connect(target) as session:
                opened.append(target.host)
                yield session
            ended.append(target.host)

    stop = Stop()
    with in_threads(login=Counting) as workers:
        list(parallel_hosts.run(targets("a", "b"), question, transport=workers, parallel=4))
        wait_for(lambda: sorted(ended) == ["a", "b"])
        events = parallel_hosts.run(targets("silent"), question, transport=workers, stop=stop, parallel=4)
        assert [type(next(events)) for _ in range(2)] == [Started, Note]
        stop.request()
        stop.request()
        list(events)
        wait_for(lambda: ended[2:] == ["silent"])
    assert len(opened) == 3


def test_each_worker_keeps_as_many_connections_as_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "MOST", 1)
    with in_threads(2) as workers:
        kept = connections.Connections(workers, Stop(), ("observe",))
        for one in targets("a", "b", "c"):
            with kept.talk(one) as host:
                host.ask({"verb": "test"})
        free = []
        for one in targets("a", "b", "c"):
            with kept.idle(one) as conversation:
                free.append(conversation is not None)
        kept.close()
    assert free == [True, True, False]


def test_ctrl_c_begins_no_more_hosts_and_again_ends_the_sessions() -> None:
    stop = Stop()
    with in_threads() as workers:
        events = parallel_hosts.run(
            targets("silent1", "silent2", "a", "b"), question, transport=workers, parallel=2, stop=stop
        )
        for _ in range(4):
            next(events)
        stop.request()
        stop.request()
        rest = list(events)
    assert {event.host for event in rest if isinstance(event, Skipped)} == {"a", "b"}
    assert {event.host: event.outcome.kind for event in rest if isinstance(event, Finished)} == dict.fromkeys(
        ("silent1", "silent2"), Kind.STOPPED
    )  # type: ignore[union-attr]


def test_a_worker_has_keys_of_its_own_home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    seen: list[Target] = []

    class Seeing(Hosts):
        def connect(self, target: Target) -> Any:
            seen.append(target)
            return super().connect(target)

    ours, other = tmp_path / ".ssh/id_swarm", Path("/etc/swarm/key")
    hop = replace(targets("hop")[0], identities=(ours,))
    host = replace(targets("a")[0], identities=(ours, other), jump=hop)
    with in_threads(1, login=Seeing) as workers:
        list(parallel_hosts.run([host], question, transport=workers, parallel=4))
    assert seen[0].identities == (Path("~/.ssh/id_swarm"), other)
    assert seen[0].jump == replace(hop, identities=(Path("~/.ssh/id_swarm"),))


def test_a_worker_whose_operator_has_gone_closes_its_sessions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "SILENCE", 0.2)
    closed = threading.Event()

    class Noticed:
        @contextmanager
        def connect(self, target: Target) -> Iterator[Session]:
            session = Agentless("silent")
            yield session
            wait_for(session._closed.is_set)
            closed.set()

    orders, reports = QueueLine(queue.Queue()), QueueLine(queue.Queue())
    orders.put(worker.packed([worker.Connect(0, targets("silent")[0])]))
    worker.serve(Noticed, orders, reports)
    assert closed.wait(PATIENCE)
