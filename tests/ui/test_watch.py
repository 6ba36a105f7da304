"""Watching hosts for the page: each at its own pace, with what is new at once, and nothing left behind."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.host_logs import HostLog
from swarmctl.remote import agent_client
from swarmctl.remote.transport import HostError, Kind, Target
from swarmctl.ui import watch as watching
from swarmctl.ui.watch import Watch
from tests.health.swarm_values import graph
from tests.timing import wait_for

HOSTS = [host.name for host in graph().hosts]
LOG = HostLog([], 0.0, cut=False)
WELL = {"robots": {}, "missing": [], "units": ["a"], "trial": "", "left": 0.0}


class Host:
    """A host as its agent: counts looks, and sends what a test puts into ``notes``."""

    def __init__(self) -> None:
        self.looks = 0
        self.open = 0
        self.answers: Callable[[], Any] = dict
        self.notes: list[dict[str, Any]] = []
        self.closed = threading.Event()

    def close(self) -> None:
        self.closed.set()

    def request(
        self, request: Mapping[str, Any], payload: bytes = b"", *, on_note: Any = None, timeout: float = 0.0
    ) -> Any:
        if self.closed.is_set():
            raise HostError(Kind.LOST, "the connection was closed")
        if request["verb"] == "probe":
            self.looks += 1
            return self.answers()
        while not self.closed.wait(0.01):
            while self.notes:
                on_note(json.dumps(self.notes.pop(0)))
        raise HostError(Kind.LOST, "the connection was closed")


class Connection:
    """One of several to a host."""

    def __init__(self, host: Host) -> None:
        self.host = host

    def __getattr__(self, name: str) -> Any:
        return getattr(self.host, name)


class Hosts:
    """A transport to hosts that are made up."""

    def __init__(self) -> None:
        self.hosts = {name: Host() for name in HOSTS}

    @contextmanager
    def connect(self, target: Target) -> Iterator[Any]:
        host = self.hosts[target.host]
        host.closed.clear()
        host.open += 1
        try:
            yield Connection(host)
        finally:
            host.closed.set()
            host.open -= 1


@pytest.fixture
def hosts(monkeypatch: pytest.MonkeyPatch) -> Hosts:
    @contextmanager
    def agent_session(session: Host, **_: Any) -> Iterator[Host]:
        yield session

    monkeypatch.setattr(agent_client, "agent_session", agent_session)
    monkeypatch.setattr(watching, "_AGAIN", 0.01)
    monkeypatch.setattr(watching, "_PAUSE", 1e6)
    return Hosts()


@contextmanager
def watched(hosts: Hosts, notes: list[Any]) -> Iterator[Watch]:
    targets = {name: Target(name, "192.0.2.1", "robot") for name in HOSTS}
    watch = Watch(graph(), targets, hosts, notes.append)  # type: ignore[arg-type]
    watch.start()
    try:
        yield watch
    finally:
        watch.stop()
        wait_for(lambda: not any(host.open for host in hosts.hosts.values()))


def outcomes(watch: Watch) -> Mapping[str, Answer | HostError]:
    return wait_for(lambda: watch.wait(0.1)).outcomes  # type: ignore[union-attr]


def test_all_hosts_answer_and_then_rest_until_something_is_new(hosts: Hosts) -> None:
    notes: list[Any] = []
    with watched(hosts, notes) as watch:
        assert outcomes(watch) == dict.fromkeys(HOSTS, Answer())
        k3 = hosts.hosts["k3-pi"]
        k3.notes += [WELL, WELL]
        wait_for(lambda: len(notes) == 2)
        assert k3.looks == 1
        for new in ({"missing": ["k3"]}, {"missing": [], "units": []}, {"units": ["a"]}):
            before = k3.looks
            k3.notes.append(WELL | new)
            wait_for(lambda: k3.looks == before + 1)  # noqa: B023
        assert hosts.hosts["epuck-pi"].looks == 1
    assert notes[2].missing == ["k3"]


def test_a_page_that_is_opened_again_has_its_own_connections(
    hosts: Hosts, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Any] = []
    monkeypatch.setattr(watching.HostReader, "last", lambda self, agent: read.append(agent) or LOG)
    with watched(hosts, []) as watch:
        outcomes(watch)
        watch.stop()
        watch.start()
        outcomes(watch)
        wait_for(lambda: hosts.hosts["k3-pi"].open == 1)
        assert watch.log("k3-pi", ["k3"]) == []
    assert [one.host for one in read] == [hosts.hosts["k3-pi"]]
    with pytest.raises(HostError, match="not connected"):
        watch.log("k3-pi", ["k3"])


def test_a_silent_host_delays_no_other_and_is_no_good_news(
    hosts: Hosts, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watching, "_OVERDUE", 0.3)
    silent = hosts.hosts["k3-pi"]
    silent.answers = silent.closed.wait
    with watched(hosts, []) as watch:
        found = outcomes(watch)
        assert found["epuck-pi"] == found["koala-laptop"] == Answer()
        assert "has not answered for" in str(found["k3-pi"])


def test_a_host_that_falls_silent_loses_its_last_answer(
    hosts: Hosts, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watching, "_SILENT", 0.2)
    with watched(hosts, []) as watch:
        outcomes(watch)
        hosts.hosts["k3-pi"].notes.append(WELL)
        wait_for(lambda: isinstance(outcomes(watch)["k3-pi"], HostError))
        hosts.hosts["k3-pi"].notes.append(WELL)
        wait_for(lambda: outcomes(watch)["k3-pi"] == Answer())


def test_a_lost_host_is_an_error_until_it_answers_again(hosts: Hosts) -> None:
    k3 = hosts.hosts["k3-pi"]

    def dies() -> Any:
        raise HostError(Kind.LOST, "gone")

    with watched(hosts, []) as watch:
        outcomes(watch)
        k3.answers = dies
        k3.notes += [WELL, WELL | {"units": []}]
        wait_for(lambda: str(outcomes(watch)["k3-pi"]) == "gone")
        k3.answers = dict
        wait_for(lambda: outcomes(watch)["k3-pi"] == Answer())


def test_what_a_host_sends_is_checked(hosts: Hosts) -> None:
    notes: list[Any] = []
    with watched(hosts, notes) as watch:
        outcomes(watch)
        hosts.hosts["k3-pi"].notes += [{"robots": 7}, WELL]
        hosts.hosts["epuck-pi"].notes.append(WELL)
        wait_for(lambda: len(notes) == 1)
        wait_for(lambda: hosts.hosts["k3-pi"].looks == 2)
        assert outcomes(watch)["k3-pi"] == Answer()
    assert [one.units for one in notes] == [WELL["units"]]


@pytest.mark.parametrize("where", ["look", "motion"])
def test_a_bug_is_an_error_of_its_host(hosts: Hosts, monkeypatch: pytest.MonkeyPatch, where: str) -> None:
    def boom(*_: object) -> None:
        raise KeyError("x")

    k3 = hosts.hosts["k3-pi"]
    with watched(hosts, []) as watch:
        outcomes(watch)
        if where == "look":
            k3.answers = boom
            k3.notes += [WELL, WELL | {"units": []}]
        else:
            monkeypatch.setattr(watching._Watched, "is_news", boom)
            k3.notes.append(WELL)
        wait_for(lambda: str(outcomes(watch)["k3-pi"]) == "k3-pi: KeyError: 'x'; this is a bug in swarmctl")
        assert outcomes(watch)["epuck-pi"] == Answer()
