"""What fails or dies on the way is undone, by the agent itself, at the next boot or by the next deploy."""

from __future__ import annotations

import pytest

from tests.onboard.agent.change import (
    AFTER_FLIP,
    BEFORE_FLIP,
    BEFORE_RECORD,
    CHANGE,
    NEW,
    OLD,
    TAKEN,
    UNDOABLE,
    runs,
)
from tests.onboard.agent.fakehost import FakeHost, bundle
from tests.sizes import some_of


@pytest.mark.parametrize("boot", [0, 1], ids=["agent killed", "power cut"])
@pytest.mark.parametrize("step", some_of(BEFORE_FLIP + AFTER_FLIP, TAKEN))
def test_what_a_dead_agent_left_is_undone_without_a_person(old: FakeHost, step: str, boot: int) -> None:
    before = old.outside()
    assert old.apply(NEW, f"after:{step}", **CHANGE).status == 137
    old.boot(boot)

    assert old.recover() == 0

    kept = step in ["done", "collect"]
    if kept:
        runs(old, NEW.digest, ("master", "khepera"))
    else:
        assert old.outside() == before
        seen = old.observe()
        assert (seen.release, seen.drift) == (OLD.digest, ({}, {}, {}))
    assert old.observe().transaction.state == ("applied" if kept or step in BEFORE_RECORD else "undone")
    assert not (old.prefix / "opt/swarm/new/state/open").exists()


@pytest.mark.parametrize("step", some_of(BEFORE_FLIP + AFTER_FLIP, TAKEN))
def test_after_a_kill_at_any_step_the_next_deploy_completes(old: FakeHost, step: str) -> None:
    old.apply(NEW, f"after:{step}", **CHANGE)
    old.recover()
    base = old.observe().release

    done = {"stop": [], "restart": [], "start": []} if base == NEW.digest else {}
    reply = old.apply(NEW, **{**CHANGE, **done, "previous": base})

    assert reply.answer["release"] == NEW.digest, reply.error
    runs(old, NEW.digest, ("master", "khepera"))
    assert set(old.units().values()) == {NEW.digest}
    assert "10.0.0.2" in old.outside()["hosts"]


@pytest.mark.parametrize("step", some_of(["record", "stop", *AFTER_FLIP[:-2]], TAKEN))
def test_a_deploy_undoes_what_a_dead_agent_left_before_anything_else(old: FakeHost, step: str) -> None:
    old.apply(NEW, f"after:{step}", **CHANGE)

    reply = old.apply(NEW, **CHANGE)  # planned for the old release

    assert reply.answer["release"] == NEW.digest, reply.error
    runs(old, NEW.digest, ("master", "khepera"))
    assert set(old.units().values()) == {NEW.digest}


def test_what_ran_runs_again_once_a_dead_agent_s_change_is_undone(old: FakeHost) -> None:
    old.apply(NEW, "after:stop", **CHANGE)
    assert sorted(old.units()) == []

    old.recover()

    assert old.units() == {"master.service": OLD.digest, "koala.service": OLD.digest}


def test_at_boot_the_start_of_the_swarm_is_queued_and_not_waited_for(old: FakeHost) -> None:
    bootable = bundle("1b", boots=True)
    old.apply(bootable, previous=OLD.digest, start=[], restart=[])
    old.apply(NEW, "after:flip", **{**CHANGE, "previous": bootable.digest})
    old.boot(1)
    old.calls()

    old.recover()

    assert [line for line in old.calls() if line.startswith("start")] == ["start --no-block -- swarm.target"]


@pytest.mark.parametrize("step", some_of(UNDOABLE, TAKEN))
def test_a_failure_after_the_first_stop_brings_the_old_release_back(old: FakeHost, step: str) -> None:
    before = old.outside()

    reply = old.apply(NEW, f"error:{step}", **CHANGE)

    assert reply.error["kind"] == "failed"
    assert "the disk is full" in reply.error["message"]
    assert f"undone, release {OLD.digest} runs again" in reply.error["message"]
    assert old.outside() == before
    runs(old, OLD.digest, ("master", "koala"))
    assert set(old.units().values()) == {OLD.digest}


@pytest.mark.parametrize("step", some_of(UNDOABLE, TAKEN))
def test_a_failed_first_deploy_leaves_the_host_as_it_was(host: FakeHost, step: str) -> None:
    before = host.outside()

    reply = host.apply(OLD, f"error:{step}")

    assert reply.error["message"].endswith("undone, the host is as before")
    assert host.outside() == before
    runs(host, None, ())  # type: ignore[arg-type]


@pytest.mark.parametrize("boot", [0, 1], ids=["agent killed", "power cut"])
@pytest.mark.parametrize("step", some_of(["undo-stop", "undo-flip", "undo-outside", "undone"], ["undo-flip"]))
def test_an_interrupted_undo_is_completed_and_its_cause_is_kept(old: FakeHost, step: str, boot: int) -> None:
    before = old.outside()
    assert old.apply(NEW, f"error:start,after:{step}", **CHANGE).status == 137
    old.boot(boot)

    assert old.recover() == 0

    last = old.observe().transaction
    assert (last.state, last.previous) == ("undone", OLD.digest)
    assert "the disk is full" in last.error
    assert old.outside() == before


@pytest.mark.parametrize("step", ["undo-stop", "undo-flip", "undo-outside"])
def test_a_recovery_that_is_interrupted_is_done_at_the_next_boot(old: FakeHost, step: str) -> None:
    before = old.outside()
    old.apply(NEW, "after:links", **CHANGE)
    old.boot(1)
    assert old.recover(f"after:{step}") == 137
    old.boot(2)

    assert old.recover() == 0

    assert old.outside() == before
    assert old.observe().transaction.state == "undone"


@pytest.mark.parametrize("step", ["stop", "flip", "reload"])
def test_a_failed_deploy_after_a_kill_restores_the_first_release(old: FakeHost, step: str) -> None:
    old.apply(NEW, f"after:{step}", **CHANGE)

    reply = old.apply(NEW, "error:start", **CHANGE)

    assert f"undone, release {OLD.digest} runs again" in reply.error["message"]
    runs(old, OLD.digest, ("master", "koala"))
    assert set(old.units().values()) == {OLD.digest}


def test_an_undo_reloads_what_the_dead_agent_had_reloaded(old: FakeHost) -> None:
    old.apply(NEW, "after:reload", **CHANGE)
    old.calls()

    old.recover()

    assert "daemon-reload" in old.calls()


def test_a_unit_that_does_not_start_is_undone_and_named(old: FakeHost) -> None:
    (old.prefix / f"broken-khepera.service-{NEW.digest}").touch()

    reply = old.apply(NEW, **CHANGE)

    assert "Job for khepera.service failed" in reply.error["message"]
    runs(old, OLD.digest, ("master", "koala"))


def test_systemd_lists_no_failed_unit_of_what_is_undone(old: FakeHost) -> None:
    old.apply(NEW, "after:start", **CHANGE)
    failed = old.prefix / "failed-khepera.service"
    failed.touch()
    old.recover()
    runs(old, OLD.digest, ("master", "koala"))
    assert not failed.exists()


def test_a_unit_that_does_not_stop_is_undone_before_anything_changed(old: FakeHost) -> None:
    (old.prefix / "sticky-koala.service").touch()

    reply = old.apply(NEW, **CHANGE)

    assert "Job for koala.service timed out" in reply.error["message"]
    assert old.observe().release == OLD.digest
