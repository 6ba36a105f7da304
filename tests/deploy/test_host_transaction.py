"""A change stays only if the host can still be reached over a new connection, and its units keep running."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.deployed import Transaction

from swarmctl.deploy import host_transaction
from swarmctl.deploy.host_transaction import HostTransaction, Terms
from swarmctl.deploy.outcome import Outcome
from swarmctl.remote import operators
from swarmctl.remote.agent_client import DirectAgentSession
from swarmctl.remote.transport import HostError, Kind, Session, Target
from swarmctl.render.bundle import Bundle
from tests.deploy.deploying import after_the_change, deploy, fails
from tests.deploy.test_rollout import TARGETS, bundles, deployed
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession
from tests.timing import PATIENCE

AWAY = HostError(Kind.UNREACHABLE, "no route to k3")
OLD, NEW = bundles()["k3"], bundles(k3="speed: 2\n")["k3"]
SHORT = Terms(healthy_for=0.1, healthy_within=1, confirm_within=0.3)


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeHost:
    monkeypatch.setattr(host_transaction, "_AGAIN", 0.02)
    monkeypatch.setattr(host_transaction, "_GRACE", 0.2)
    made = FakeHost(tmp_path)
    sudo = made.prefix / "bin/sudo"
    sudo.write_text('#!/bin/sh\nshift\nexec "$@"\n')
    sudo.chmod(0o755)
    assert isinstance(run(made, OLD), Outcome)
    return made


class Way:
    """The way to the host. ``cut`` returns whether the connection of this number fails."""

    def __init__(self, host: FakeHost, cut: Callable[[int], bool], failpoint: str = "") -> None:
        self.host, self.cut, self.failpoint = host, cut, failpoint
        self.connections = 0

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        self.connections += 1
        if self.cut(self.connections):
            raise AWAY
        first = self.connections == 1
        yield LocalSession(self.host.environment(self.failpoint if first else ""))


def run(
    host: FakeHost,
    bundle: Bundle,
    cut: Callable[[int], bool] = lambda _: False,
    failpoint: str = "",
    terms: Terms | None = None,
) -> Outcome | HostError:
    way = Way(host, cut, failpoint)
    return deployed(deploy({"k3": bundle}, TARGETS, way, terms=terms or Terms()))["k3"]


def last(host: FakeHost) -> Transaction:
    return host.observe().transaction


def test_a_change_is_confirmed_over_a_new_connection(host: FakeHost) -> None:
    way = Way(host, lambda _: False)

    result = deployed(deploy({"k3": NEW}, TARGETS, way))["k3"]

    assert isinstance(result, Outcome)
    assert way.connections == 2
    assert last(host).state == "applied"


def test_a_login_that_runs_nothing_does_not_confirm(host: FakeHost) -> None:
    """Its login shell is gone, or the host can start no process any more."""

    class Refusing(Way):
        @contextmanager
        def connect(self, target: Target) -> Iterator[Session]:
            with super().connect(target) as session:
                yield session if self.connections == 1 else LocalSession(host.environment(), ["/bin/false"])

    result = deployed(deploy({"k3": NEW}, TARGETS, Refusing(host, lambda _: False), terms=SHORT))["k3"]

    assert isinstance(result, HostError)
    assert last(host).state == "pending"  # until its deadline


@pytest.mark.parametrize("applied_before", [False, True], ids=["own change", "an earlier run's"])
def test_the_login_that_confirms_begins_once_units_have_kept_running(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch, applied_before: bool
) -> None:
    """What locks the operator out a few s after the change must not be confirmed by an older login."""
    way, logins = Way(host, lambda _: False), []
    hold = HostTransaction._hold
    if applied_before:
        pending(host, gone())

    def recorded(self: HostTransaction, *arguments: Any) -> Any:
        found = hold(self, *arguments)
        logins.append(way.connections)
        return found

    monkeypatch.setattr(HostTransaction, "_hold", recorded)
    assert isinstance(deployed(deploy({"k3": NEW}, TARGETS, way))["k3"], Outcome)
    assert (logins, way.connections) == ([1], 2)
    assert last(host).state == "applied"


def test_nothing_to_do_takes_one_connection(host: FakeHost) -> None:
    way = Way(host, lambda _: False)
    result = deployed(deploy({"k3": OLD}, TARGETS, way))["k3"]
    assert isinstance(result, Outcome)
    assert (way.connections, result.changed) == (1, False)


def test_a_host_that_is_away_for_a_moment_is_confirmed_all_the_same(host: FakeHost) -> None:
    assert isinstance(run(host, NEW, cut=lambda number: 1 < number < 5), Outcome)
    assert last(host).state == "applied"


def test_a_change_that_locks_its_operator_out_goes_back(host: FakeHost) -> None:
    result = run(host, NEW, cut=lambda number: number > 1, terms=SHORT)

    assert isinstance(result, HostError)
    assert result.kind is Kind.LOST
    assert "it was changed and does not answer since: no route to k3" in result.message
    assert host.recover() == 0
    assert host.observe().release == OLD.digest
    assert last(host).state == "undone"


def test_a_host_that_answers_again_after_it_went_back_says_so(host: FakeHost) -> None:
    went_back = []

    def cut(number: int) -> bool:
        if number == 3:
            went_back.append(host.recover())  # returns once the deadline has passed
        return number == 2

    result = run(host, NEW, cut=cut, terms=SHORT)

    assert went_back == [0]
    assert isinstance(result, HostError)
    assert result.kind is Kind.FAILED
    assert f"not confirmed in time; undone, release {OLD.digest} runs again" in result.message


def test_units_that_do_not_keep_running_take_the_change_back(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    after_the_change(monkeypatch, lambda: fails(host, "new.robot.service"))
    result = run(host, NEW, terms=replace(SHORT, confirm_within=PATIENCE))

    assert isinstance(result, HostError)
    assert "new.robot.service does not keep running" in result.message
    assert host.observe().release == OLD.digest


@pytest.mark.parametrize("step", ["record", "stop", "flip", "links", "reload", "start"])
def test_of_a_killed_agent_the_same_run_says_what_became_of_it(host: FakeHost, step: str) -> None:
    result = run(host, NEW, failpoint=f"after:{step}")

    assert isinstance(result, HostError)
    assert result.message == f"the deploy was interrupted; undone, release {OLD.digest} runs again"
    assert host.observe().release == OLD.digest


def test_an_agent_that_dies_after_its_last_step_is_no_failure(host: FakeHost) -> None:
    assert isinstance(run(host, NEW, failpoint="after:pending"), Outcome)
    assert last(host).state == "applied"


def test_an_agent_that_dies_before_its_first_step_has_changed_nothing(host: FakeHost) -> None:
    result = run(host, NEW, failpoint="after:verify")

    assert isinstance(result, HostError)
    assert "the agent ended without an answer" in result.message
    assert last(host).next == OLD.digest


def test_a_deploy_beside_a_removal_is_refused(host: FakeHost) -> None:
    path = host.prefix / "opt/swarm/new/state/transaction.json"
    record = {**json.loads(path.read_text()), "state": "removing", "txid": "", "who": "anna@desk (7)"}
    path.write_text(json.dumps(record))
    result = run(host, NEW)
    assert isinstance(result, HostError)
    assert (result.kind, result.message) == (
        Kind.REFUSED,
        "the removal of the swarm is not finished, by anna@desk (7)",
    )


def pending(host: FakeHost, who: str) -> None:
    """A change whose operator went away before the confirmation."""
    unit = "new.robot.service"
    reply = host.apply(NEW, previous=OLD.digest, start=[], restart=[unit], who=who, confirm_within=100)
    assert reply.answer, reply.error


def gone() -> str:
    """This operator, in a run that has ended."""
    child = os.fork()
    if not child:
        os._exit(0)
    os.waitpid(child, 0)
    return f"{operators.this_one().rpartition(' (')[0]} ({child})"


def test_the_next_run_confirms_what_an_earlier_one_has_applied(host: FakeHost) -> None:
    pending(host, gone())

    result = run(host, NEW)

    assert isinstance(result, Outcome)
    assert result.changed
    assert last(host).state == "applied"


def test_the_change_of_an_own_run_that_has_ended_is_undone(host: FakeHost) -> None:
    pending(host, gone())
    third = bundles(k3="speed: 3\n")["k3"]

    assert isinstance(run(host, third), Outcome)

    assert last(host).previous == OLD.digest
    assert host.observe().release == third.digest


@pytest.mark.parametrize("bundle", [NEW, bundles(k3="speed: 3\n")["k3"]], ids=["the same", "another"])
@pytest.mark.parametrize("who", ["anna@desk (7)", operators.this_one().replace(str(os.getpid()), "1")])
def test_the_change_of_another_run_is_left_alone_and_named(host: FakeHost, who: str, bundle: Bundle) -> None:
    """It may still be undone there, as other hosts have failed."""
    pending(host, who)

    result = run(host, bundle)

    assert isinstance(result, HostError)
    assert result.message == f"locked by {who}, whose deploy waits for its confirmation"
    assert last(host).state == "pending"


def test_while_the_agent_of_another_operator_works_its_host_is_locked(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An own agent would be waited for much longer."""
    waits = []
    ask = DirectAgentSession.request

    def asking(self: DirectAgentSession, request: Any, payload: bytes = b"", **more: Any) -> Any:
        if request["verb"] == "undo":
            waits.append(request["wait"])
        return ask(self, request, payload, **more)

    monkeypatch.setattr(DirectAgentSession, "request", asking)
    state = host.prefix / "opt/swarm/new/state"
    who = "anna@desk (7)"
    assert host.apply(NEW, "after:flip", previous=OLD.digest, who=who).status == 137
    with (state / "lock").open("r+") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        lock.truncate()
        json.dump({"who": who, "pid": 9}, lock)
        lock.flush()
        result = run(host, bundles(k3="speed: 3\n")["k3"])

    assert isinstance(result, HostError)
    assert result.message == f"locked by {who} (process 9)"
    assert waits == [host_transaction._OTHERS_WAIT]
