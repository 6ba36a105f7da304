"""A change stays pending until it is confirmed; the deadline, a restart or units that end undo it."""

from __future__ import annotations

import fcntl
import multiprocessing
import os
import random
import socket
import time
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent import boot, lock, record, recovery, transaction
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.release_store import Home

from swarmctl.remote.agent_archive import agent
from tests.onboard.agent.change import CHANGE, NEW, OLD, runs
from tests.onboard.agent.fakehost import FakeHost, Reply
from tests.timing import PATIENCE

RACES = int(os.environ.get("SWARM_RACES", "30"))
TXID = "0123456789abcdef"


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    host = FakeHost(tmp_path)
    assert host.apply(OLD).answer["release"] == OLD.digest
    return host


def apply(host: FakeHost, within: float = 100, failpoint: str = "", **more: Any) -> Reply:
    return host.apply(NEW, failpoint, **{**CHANGE, "txid": TXID, "confirm_within": within, **more})


def ask(host: FakeHost, verb: str, failpoint: str = "", **more: Any) -> Reply:
    return host.ask({"verb": verb, "swarm": "new", "txid": TXID, "wait": 0.3, **more}, failpoint=failpoint)


def state(host: FakeHost) -> str:
    return str(host.observe().transaction.state)


def is_old(host: FakeHost) -> None:
    runs(host, OLD.digest, ("master", "koala"))
    assert set(host.units().values()) == {OLD.digest}
    assert state(host) == "undone"


def test_a_confirmed_change_stays(host: FakeHost) -> None:
    assert apply(host).answer["release"] == NEW.digest
    pending = host.observe().transaction
    assert (pending.state, pending.txid) == ("pending", TXID)
    assert 0 < pending.left <= 100

    assert ask(host, "confirm").answer == {"release": NEW.digest}

    host.boot(1)
    assert host.recover() == 0
    runs(host, NEW.digest, ("master", "khepera"))
    assert state(host) == "applied"


def test_confirming_again_is_no_error(host: FakeHost) -> None:
    apply(host)
    ask(host, "confirm")

    assert ask(host, "confirm").answer == {"release": NEW.digest}


def test_without_a_confirmation_a_change_is_undone_at_its_deadline(host: FakeHost) -> None:
    apply(host, within=0.5)

    assert host.recover() == 0  # ends once nothing is open

    is_old(host)
    assert "not confirmed in time" in ask(host, "confirm").error["message"]


def test_the_archive_that_the_host_keeps_contains_its_recovery(host: FakeHost, tmp_path: Path) -> None:
    archive = tmp_path / "agent.zip"
    archive.write_bytes(agent().archive)
    apply(host, within=0.05)

    assert host.recover(code=str(archive)) == 0

    is_old(host)


def test_nothing_changes_on_a_host_that_could_not_undo_it(host: FakeHost) -> None:
    (host.prefix / "no-recovery").touch()

    reply = apply(host)

    assert "nothing was changed, since the host could not undo it" in reply.error["message"]
    runs(host, OLD.digest, ("master", "koala"))


def test_a_confirmation_that_comes_too_late_undoes_the_change_itself(host: FakeHost) -> None:
    apply(host, within=0.05)
    time.sleep(0.1)

    reply = ask(host, "confirm")

    assert reply.error["kind"] == "failed"
    assert "not confirmed in time; undone" in reply.error["message"]
    is_old(host)


def test_an_undo_meant_for_a_dead_agent_spares_a_change_that_went_on(host: FakeHost) -> None:
    apply(host)

    reply = ask(host, "undo", pending=False)

    assert "whose deploy waits for its confirmation" in reply.error["message"]
    assert state(host) == "pending"
    assert ask(host, "undo").answer == {"release": OLD.digest}


def test_an_undo_meant_for_a_dead_agent_spares_a_confirmed_change(host: FakeHost) -> None:
    apply(host)
    ask(host, "confirm")

    assert ask(host, "undo", pending=False).answer == {"release": NEW.digest}

    runs(host, NEW.digest, ("master", "khepera"))


@pytest.mark.parametrize("asks_first", [True, False], ids=["operator first", "recovery first"])
def test_a_host_that_restarts_before_the_confirmation_goes_back(host: FakeHost, asks_first: bool) -> None:
    apply(host)
    host.boot(1)

    if not asks_first:
        host.recover()
    reply = ask(host, "confirm")
    if asks_first:
        host.recover()

    assert "restarted before the deploy was confirmed" in reply.error["message"]
    is_old_after_boot = host.observe()
    assert is_old_after_boot.release == OLD.digest
    assert is_old_after_boot.drift == ({}, {}, {})


def test_another_change_is_not_confirmed(host: FakeHost) -> None:
    apply(host)

    reply = ask(host, "confirm", txid="f" * 16)

    assert reply.error["kind"] == "refused"
    assert state(host) == "pending"


def test_while_a_change_waits_nobody_else_deploys(host: FakeHost) -> None:
    apply(host, who="anna@desk")

    reply = host.apply(OLD, previous=NEW.digest, start=[], who="bob")

    assert reply.error["message"] == "locked by anna@desk, whose deploy waits for its confirmation"
    assert state(host) == "pending"


def test_a_pending_change_can_be_undone_at_once(host: FakeHost) -> None:
    apply(host)

    assert ask(host, "undo").answer == {"release": OLD.digest}

    is_old(host)


def test_a_confirmed_change_is_not_undone(host: FakeHost) -> None:
    apply(host)
    ask(host, "confirm")

    assert ask(host, "undo").error["kind"] == "refused"
    runs(host, NEW.digest, ("master", "khepera"))


def test_a_change_whose_units_do_not_keep_running_is_undone(host: FakeHost) -> None:
    apply(host)
    (host.prefix / "units/khepera.service").unlink()
    (host.prefix / "failed-khepera.service").touch()

    reply = ask(host, "hold", seconds=1, within=5)

    assert "khepera.service does not keep running" in reply.error["message"]
    is_old(host)


def test_units_that_run_hold(host: FakeHost) -> None:
    apply(host)

    assert set(ask(host, "hold", seconds=0.2, within=1).answer["units"]) == {
        "master.service",
        "khepera.service",
    }
    assert state(host) == "pending"


@pytest.mark.parametrize("boot_number", [0, 1], ids=["agent killed", "power cut"])
@pytest.mark.parametrize("step", ["lock", "done", "collect"])
def test_a_confirmation_that_is_cut_off_is_old_or_new(host: FakeHost, step: str, boot_number: int) -> None:
    apply(host)
    assert ask(host, "confirm", f"after:{step}").status == 137
    host.boot(boot_number)

    if boot_number:
        host.recover()
    again = ask(host, "confirm")

    if step == "lock" and boot_number:
        assert again.error["kind"] == "failed"
        assert host.observe().release == OLD.digest
    else:
        assert again.answer == {"release": NEW.digest}
        runs(host, NEW.digest, ("master", "khepera"))


def test_a_first_release_that_nobody_confirms_leaves_nothing(tmp_path: Path) -> None:
    host = FakeHost(tmp_path)
    before = sorted((tmp_path / "etc").rglob("*")), (tmp_path / "etc/hosts").read_text()
    host.apply(OLD, txid=TXID, confirm_within=0.05)

    host.recover()

    assert (sorted((tmp_path / "etc").rglob("*")), (tmp_path / "etc/hosts").read_text()) == before
    assert host.units() == {}
    assert host.observe().releases == []


@pytest.mark.parametrize("is_open", [False, True])
def test_the_recovery_unit_is_ready_before_it_waits_for_an_agent(host: FakeHost, is_open: bool) -> None:
    """Its start is waited for by the agent, which holds the lock."""
    if is_open:
        apply(host)
    else:
        host.boot(1)
    address = host.prefix / "notify"
    with (
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notified,
        (host.prefix / "opt/swarm/new/state/lock").open() as held,
    ):
        notified.bind(str(address))
        notified.settimeout(PATIENCE)
        fcntl.flock(held, fcntl.LOCK_EX)
        with host.recovering(NOTIFY_SOCKET=str(address)) as process:
            try:
                assert notified.recv(100) == b"READY=1"
                assert process.poll() is None
            finally:
                fcntl.flock(held, fcntl.LOCK_UN)
                ask(host, "confirm")
            assert process.wait(PATIENCE) == 0


def test_a_change_of_an_earlier_boot_is_undone_before_units_start(host: FakeHost) -> None:
    apply(host)
    host.boot(1)
    address = host.prefix / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notified:
        notified.bind(str(address))
        notified.settimeout(PATIENCE)
        with host.recovering(NOTIFY_SOCKET=str(address)):
            assert notified.recv(100) == b"READY=1"
            assert (host.prefix / "opt/swarm/new/current").readlink().name == OLD.digest


# Races


class Race:
    """Both sides in processes of their own, at random instants around the deadline of a pending change.

    The deadline is set once both processes run: how long they take to start does not decide who is first.
    """

    def __init__(self, host: FakeHost) -> None:
        self.home = Home("new", str(host.prefix))
        self.fork = multiprocessing.get_context("fork")

    def run(self, number: int) -> tuple[bool, str]:
        """Returns whether the operator saw its change confirmed, and the state afterwards."""
        seed, answers = random.Random(number), self.fork.SimpleQueue()
        up, deadline_set = self.fork.Barrier(3), self.fork.Barrier(3)
        sides = [
            self.fork.Process(
                target=side, args=(self.home, up, deadline_set, seed.uniform(-0.03, 0.03), answers)
            )
            for side in (confirming, recovering)
        ]
        for side in sides:
            side.start()
        up.wait(PATIENCE)
        pending = record.read(self.home)._replace(
            state=record.PENDING, txid=TXID, boot_id=boot.identity(self.home), deadline=boot.now() + 0.04
        )
        record.write(self.home, pending)
        deadline_set.wait(PATIENCE)
        for side in sides:
            side.join(PATIENCE)
            assert side.exitcode == 0
        return answers.get(), record.read(self.home).state


def wait_until(home: Home, up: Barrier, deadline_set: Barrier, after_deadline: float) -> None:
    up.wait(PATIENCE)
    deadline_set.wait(PATIENCE)
    instant = record.read(home).deadline + after_deadline
    while boot.now() < instant:
        time.sleep(0.0005)


def confirming(home: Home, up: Barrier, deadline_set: Barrier, after_deadline: float, answers: Any) -> None:
    wait_until(home, up, deadline_set, after_deadline)
    try:
        with lock.held(home, "operator", 20):
            transaction.confirm(home, TXID)
        answers.put(True)
    except RefusedError:
        answers.put(False)


def recovering(home: Home, up: Barrier, deadline_set: Barrier, after_deadline: float, _: Any) -> None:
    wait_until(home, up, deadline_set, after_deadline)
    recovery.settle(home)


def test_confirmation_and_deadline_agree_whoever_comes_first(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SWARM_RACES sets the number of races; `make races` runs 1 000."""
    for name, value in host.environment().items():
        monkeypatch.setenv(name, value)
    apply(host)
    race, outcomes = Race(host), []
    for number in range(RACES):
        confirmed, after = race.run(number)
        assert (confirmed, after) in [(True, "applied"), (False, "undone")]
        outcomes.append(confirmed)
    assert {True, False} == set(outcomes)
