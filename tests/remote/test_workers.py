"""Sessions in the workers of a Dask cluster: all is as without, and a lost worker costs its own hosts."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from swarmctl.remote import agent_client, connections, dask_cluster, parallel_hosts
from swarmctl.remote.dask_cluster import ClusterError, Workers, address_of
from swarmctl.remote.parallel_hosts import Finished, Note, Started, Stop, not_started
from swarmctl.remote.transport import HostError, Kind, Output, Session, Target
from swarmctl.remote.worker import BecomeRoot
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import HOSTS, TARGETS, FolderTransport, bundles, changed, deployed, hosts
from tests.onboard.agent.fakehost import FakeHost
from tests.timing import PATIENCE, wait_for

distributed = pytest.importorskip("distributed", reason="needs swarmctl[scale]")
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


class Recorded(Hosts):
    """As ``Hosts``, and records targets; workers in threads of the tests share the records."""

    opened: list[Target] = []  # noqa: RUF012  (shared on purpose)
    ended: list[str] = []  # noqa: RUF012

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        with super().connect(target) as session:
            self.opened.append(target)
            yield session
        self.ended.append(target.host)


@pytest.fixture
def records() -> Iterator[type[Recorded]]:
    yield Recorded
    Recorded.opened.clear()
    Recorded.ended.clear()


def targets(*names: str) -> list[Target]:
    return [Target(name, "192.0.2.1", "root") for name in names]


def question(session: Session, target: Target, note: Callable[[str], None]) -> Any:
    with agent_client.agent_session(session) as host:
        return host.request({"verb": "test"}, on_note=note)


@contextmanager
def cluster_in_threads(count: int = 2) -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=count, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tcp"
    ) as cluster:
        yield cluster


@contextmanager
def in_threads(count: int = 2, login: Callable[[], Any] = Hosts) -> Iterator[Workers]:
    with cluster_in_threads(count) as cluster:
        address = address_of(cluster.scheduler_address.replace("tcp", "dask"))
        with dask_cluster.workers(address, login=login) as workers:
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
    assert "locked rejected the login (on worker tcp://" in found["locked"].message
    assert found["locked"].hint.startswith("workers log in with their own keys")
    assert found["buggy"] == HostError(Kind.BUG, "KeyError: 'x'")


def test_hosts_are_spread_over_workers_and_events_are_complete() -> None:
    names = [f"h{n}" for n in range(8)]
    with in_threads() as workers:
        events = list(parallel_hosts.run(targets(*names), question, transport=workers, parallel=4))
    for name in names:
        mine = [event for event in events if event.host == name]
        assert [type(event) for event in mine] == [Started, Note, Finished]
        assert mine[2].outcome == {"host": name}  # type: ignore[union-attr]


def test_a_lost_worker_costs_its_hosts_and_the_others_go_on() -> None:
    with cluster_in_threads(2) as cluster:
        address = address_of(cluster.scheduler_address.replace("tcp", "dask"))
        with dask_cluster.workers(address, login=Hosts) as workers:
            names = ("silent1", "silent2", "a", "b")
            events = parallel_hosts.run(targets(*names), question, transport=workers, parallel=2)
            for _ in range(4):  # both have begun, and each has sent a note
                next(events)
            cluster.sync(cluster.workers[0].close)
            first = next(event for event in events if isinstance(event, Finished))
            assert isinstance(first.outcome, HostError)
            assert first.outcome.kind is Kind.LOST
            assert f"was lost while it was connected to {first.host}" in first.outcome.message
            found = [next(event for event in events if isinstance(event, Finished)) for _ in range(2)]
            assert [one.outcome for one in found] == [{"host": "a"}, {"host": "b"}]
            cluster.sync(cluster.workers[1].close)
            assert len(outcomes(events)) == 1
            none = outcomes(parallel_hosts.run(targets("c"), question, transport=workers, parallel=4))["c"]
            assert str(none) == "c was not reached: no worker is left"


def test_a_worker_keeps_no_session_that_the_operator_has_ended(records: type[Recorded]) -> None:
    stop = Stop()
    with in_threads(login=Recorded) as workers:
        list(parallel_hosts.run(targets("a", "b"), question, transport=workers, parallel=4))
        wait_for(lambda: sorted(records.ended) == ["a", "b"])
        events = parallel_hosts.run(targets("silent"), question, transport=workers, stop=stop, parallel=4)
        assert [type(next(events)) for _ in range(2)] == [Started, Note]
        stop.request()
        stop.request()
        list(events)
        wait_for(lambda: records.ended[2:] == ["silent"])
    assert len(records.opened) == 3


def test_an_order_after_the_end_of_its_session_opens_none(records: type[Recorded]) -> None:
    with in_threads(1, login=Recorded) as workers:
        with workers.connect(targets("a")[0]) as session, agent_client.agent_session(session) as host:
            host.request({"verb": "test"})
        for method, args in (("answer", (0, targets("a")[0], BecomeRoot())), ("more", (0,))):
            late = getattr(workers._all[0].actor, method)(*args).result(PATIENCE)
            assert (late.kind, str(late)) == (Kind.LOST, "the connection was closed")
    assert len(records.opened) == 1


def test_a_worker_whose_operator_has_gone_closes_its_sessions(records: type[Recorded]) -> None:
    with cluster_in_threads(1) as cluster:
        client = distributed.Client(cluster.scheduler_address, set_as_default=False)
        worker = dask_cluster._Worker(client, next(iter(client.scheduler_info()["workers"])), Recorded)
        connected = Workers([worker]).connect(targets("a")[0])
        with connected as session, agent_client.agent_session(session) as host:
            host.request({"verb": "test"})
            assert not records.ended
            client.close()
            wait_for(lambda: records.ended == ["a"])


def test_each_worker_keeps_as_many_connections_as_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "MOST", 1)
    with in_threads(2) as workers:
        kept = connections.Connections(workers, Stop(), ("observe",))
        for one in targets("a", "b", "c"):
            with kept.agent_session(one) as host:
                host.request({"verb": "test"})
        free = []
        for one in targets("a", "b", "c"):
            with kept.idle(one) as agent:
                free.append(agent is not None)
        kept.close()
    assert free == [True, True, False]


def test_ctrl_c_begins_no_more_hosts_and_again_ends_the_sessions() -> None:
    stop = Stop()
    with in_threads() as workers:
        names = ("silent1", "silent2", "a", "b")
        events = parallel_hosts.run(targets(*names), question, transport=workers, parallel=2, stop=stop)
        for _ in range(4):
            next(events)
        stop.request()
        stop.request()
        rest = list(events)
    ended = {event.host: event for event in rest if isinstance(event, Finished)}
    assert [ended[name] for name in ("a", "b")] == [not_started("a"), not_started("b")]
    assert {one.outcome.kind for one in ended.values()} == {Kind.STOPPED}
    assert ended.keys() == set(names)


def test_a_worker_has_keys_of_its_own_home(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, records: type[Recorded]
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    ours, other = tmp_path / ".ssh/id_swarm", Path("/etc/swarm/key")
    hop = replace(targets("hop")[0], identities=(ours,))
    host = replace(targets("a")[0], identities=(ours, other), jump=hop)
    with in_threads(1, login=Recorded) as workers:
        list(parallel_hosts.run([host], question, transport=workers, parallel=4))
    assert records.opened[0].identities == (Path("~/.ssh/id_swarm"), other)
    assert records.opened[0].jump == replace(hop, identities=(Path("~/.ssh/id_swarm"),))


BEGUN, END = threading.Event(), threading.Event()


def other_task() -> None:
    BEGUN.set()
    END.wait(PATIENCE)


def test_a_worker_that_is_busy_with_other_tasks_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_cluster, "CONNECT", 0.3)
    with cluster_in_threads(1) as cluster, distributed.Client(cluster, set_as_default=False) as client:
        address = address_of(cluster.scheduler_address.replace("tcp", "dask"))
        task = client.submit(other_task)
        assert BEGUN.wait(PATIENCE)
        busy = pytest.raises(ClusterError, match=r"the worker tcp://\S+ does not begin: ")
        with busy as found, dask_cluster.workers(address, login=Hosts):
            raise AssertionError
        END.set()
        task.result(PATIENCE)
    assert "end the tasks that keep it busy" in found.value.fix
