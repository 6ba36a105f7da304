"""A change takes a host from one release to another, and touches nothing else; one is made at a time."""

from __future__ import annotations

import fcntl
import os
import signal

import pytest

from tests.onboard.agent.change import CHANGE, NEW, OLD, runs
from tests.onboard.agent.fakehost import FakeHost, bundle, decode, payload_of, request_for
from tests.timing import PATIENCE


def test_a_first_deploy_brings_everything(host: FakeHost) -> None:
    reply = host.apply(OLD)

    assert {name: unit.active for name, unit in host.observe().units.items()} == {
        "master.service": "active",
        "koala.service": "active",
    }
    assert reply.answer["previous"] is None
    runs(host, OLD.digest, ("master", "koala"))
    assert host.read("/etc/hosts") == b"127.0.0.1 localhost\n# >>> swarm new\n10.0.0.1 pi\n# <<< swarm new\n"
    link = host.prefix / "etc/systemd/system/koala.service"
    assert str(link.readlink()) == "/opt/swarm/new/current/units/koala.service"


def test_a_change_touches_the_units_it_names_and_no_other(old: FakeHost) -> None:
    later = bundle("1", hosts="10.0.0.3 pi\n")
    before = (old.prefix / "units/koala.service").read_text()

    old.apply(later, previous=OLD.digest, start=[], restart=["master.service"])

    assert old.units() == {"master.service": later.digest, "koala.service": OLD.digest}
    assert (old.prefix / "units/koala.service").read_text() == before
    assert old.calls() == [
        "stop -- master.service",
        "reset-failed -- master.service",
        "start -- master.service",
    ]


def test_units_stop_before_the_flip_and_start_in_manifest_order(
    old: FakeHost,
) -> None:
    old.apply(NEW, **{**CHANGE, "start": ["khepera.service"], "restart": ["master.service"]})

    assert old.calls() == [
        "stop -- koala.service master.service",
        "daemon-reload",
        "reset-failed -- master.service khepera.service",
        "start -- master.service khepera.service",
    ]
    assert set(old.units().values()) == {NEW.digest}


def test_a_fixed_link_is_read_even_if_that_deploy_died(old: FakeHost) -> None:
    (old.prefix / "etc/systemd/system/koala.service").unlink()
    old.apply(OLD, "after:links", previous=OLD.digest, start=[])
    assert "daemon-reload" not in old.calls()

    old.recover()

    assert "daemon-reload" in old.calls()


def test_a_unit_file_that_changes_under_its_link_is_read_again(old: FakeHost) -> None:
    later = bundle("2")

    old.apply(later, previous=OLD.digest, start=[])

    assert old.calls() == ["daemon-reload"]


def test_a_recovery_unit_of_another_version_is_read_again(old: FakeHost) -> None:
    """Else systemd starts a module that the archive no longer has, and nothing is deployed."""
    unit = old.prefix / "etc/systemd/system/swarm-recovery@new.service"
    unit.write_text(unit.read_text().replace("swarm_onboard.agent.recovery", "recovery_of_yore"))

    old.apply(bundle("1", hosts="10.0.0.3 pi\n"), previous=OLD.digest, start=[], restart=["master.service"])

    assert old.calls()[0] == "daemon-reload"
    assert "swarm_onboard.agent.recovery" in unit.read_text()


def test_systemd_lists_no_failed_unit_of_the_release_before(old: FakeHost) -> None:
    failed = old.prefix / "failed-koala.service"
    failed.touch()
    old.apply(NEW, **CHANGE)
    runs(old, NEW.digest, ("master", "khepera"))
    assert not failed.exists()


@pytest.mark.parametrize("step", ["stage", "sync", "verify"])
def test_a_full_disk_while_staging_changes_nothing(old: FakeHost, step: str) -> None:
    reply = old.apply(NEW, f"error:{step}", **CHANGE)

    assert reply.error["kind"] == "failed"
    assert "the disk is full" in reply.error["message"]
    assert old.calls() == []
    assert old.observe().release == OLD.digest
    assert old.apply(NEW, **CHANGE).answer["release"] == NEW.digest
    runs(old, NEW.digest, ("master", "khepera"))


def test_a_damaged_release_is_repaired_under_its_own_name(old: FakeHost) -> None:
    release = old.prefix / f"opt/swarm/new/releases/{OLD.digest}"
    (release / "params/koala.yaml").write_text("speed: 99\n")
    (release / "hosts").unlink()
    (release / "stray").touch()
    assert old.observe().drift.files == {
        "params/koala.yaml": "changed",
        "hosts": "missing",
        "stray": "extra",
    }

    old.apply(OLD, previous=OLD.digest, start=[], restart=["koala.service"])

    runs(old, OLD.digest, ("master", "koala"))


@pytest.mark.parametrize("target", ["releases/ffffffffffffffff", "/etc", "releases/../../..", "x"])
def test_a_link_that_leads_nowhere_of_ours_is_put_right(host: FakeHost, target: str) -> None:
    host.apply(OLD)
    current = host.prefix / "opt/swarm/new/current"
    current.unlink()
    current.symlink_to(target)
    assert host.apply(NEW, previous=host.observe().release).answer["release"] == NEW.digest
    assert host.observe().release == NEW.digest
    assert host.observe().drift == ({}, {}, {})


def test_a_folder_in_place_of_the_link_is_refused(host: FakeHost) -> None:
    host.apply(OLD)
    current = host.prefix / "opt/swarm/new/current"
    current.unlink()
    current.mkdir()
    host.calls()
    reply = host.apply(NEW, previous=None)
    assert reply.error["kind"] == "refused"
    assert "current is a folder, and swarmctl needs a link there" in reply.error["message"]
    assert host.calls() == []


def test_a_bad_release_is_not_tried_again_after_another_bad_one(host: FakeHost) -> None:
    host.apply(OLD)
    for unit, release in (("khepera.service", NEW), ("master.service", OLD)):
        (host.prefix / f"broken-{unit}-{release.digest}").touch()
    changes = {"stop": ["koala.service"], "restart": ["master.service"], "start": ["khepera.service"]}
    reply = host.apply(NEW, previous=OLD.digest, **changes)
    message = reply.error["message"]
    first, _, then = message.partition(f"undone, release {OLD.digest} is in place again; but ")
    assert "Job for khepera.service failed" in first
    assert "Job for master.service failed" in then
    assert host.observe().release == OLD.digest
    host.calls()
    assert host.recover() == 0
    assert host.calls() == []  # nothing is tried again


def test_links_and_blocks_that_went_astray_are_put_right(old: FakeHost) -> None:
    system = old.prefix / "etc/systemd/system"
    (system / "koala.service").unlink()
    (system / "ghost.service").symlink_to("/opt/swarm/new/current/units/ghost.service")
    (old.prefix / "etc/hosts").write_bytes(b"127.0.0.1 localhost\n")
    links = {"koala": "missing", "ghost": "extra"}
    assert old.observe().drift == (
        {},
        {f"/etc/systemd/system/{name}.service": state for name, state in links.items()},
        {"/etc/hosts": "missing"},
    )

    old.apply(OLD, previous=OLD.digest, start=[])

    runs(old, OLD.digest, ("master", "koala"))
    assert "daemon-reload" in old.calls()


def test_an_earlier_release_on_the_host_needs_no_upload(old: FakeHost) -> None:
    old.apply(NEW, **CHANGE)

    back = request_for(OLD, previous=NEW.digest, stop=["khepera.service"], restart=["master.service"])
    assert old.ask(back).answer["release"] == OLD.digest

    runs(old, OLD.digest, ("master", "koala"))


def test_the_current_release_and_two_before_it_are_kept(host: FakeHost) -> None:
    releases = [bundle(str(number)) for number in range(6)]
    for before, after in zip([None, *releases], releases, strict=False):
        host.apply(after, previous=before.digest if before else None, start=[])

    assert host.observe().releases == sorted(release.digest for release in releases[-3:])


def test_a_plan_for_another_release_is_refused(old: FakeHost) -> None:
    reply = old.apply(NEW, **{**CHANGE, "previous": NEW.digest})

    assert reply.error["kind"] == "refused"
    assert reply.error["message"].startswith("stale plan")
    assert old.calls() == []


def test_only_one_deploys_at_a_time_and_the_other_learns_who(old: FakeHost) -> None:
    (old.prefix / "opt/swarm/new/state/lock").write_text('{"who": "anna@desk", "pid": 7}')
    with (old.prefix / "opt/swarm/new/state/lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert old.observe().lock == "anna@desk (process 7)"
        reply = old.apply(NEW, **CHANGE)

    assert reply.error["message"] == "locked by anna@desk (process 7)"
    assert old.apply(NEW, **CHANGE).answer["release"] == NEW.digest


def test_no_other_account_can_hold_the_lock(old: FakeHost) -> None:
    lock = old.prefix / "opt/swarm/new/state/lock"
    lock.chmod(0o644)
    assert not old.apply(NEW, **CHANGE).error
    assert lock.stat().st_mode & 0o077 == 0


def test_of_two_deploys_at_once_one_wins(old: FakeHost) -> None:
    (old.prefix / "slow").touch()
    with old.begin(request_for(NEW, **CHANGE), payload_of(NEW)) as first:
        assert first.stdout is not None
        first.stdout.readline()
        first.stdout.readline()
        second = old.apply(NEW, **CHANGE, who="bob", wait=0)
        first.stdout.read()

    assert second.error["message"].startswith("locked by someone@laptop (process ")
    runs(old, NEW.digest, ("master", "khepera"))


def test_what_belongs_to_others_is_not_overwritten(host: FakeHost) -> None:
    (host.prefix / "etc/systemd/system/koala.service").write_text("# by hand\n")
    before = host.outside()

    reply = host.apply(OLD)

    assert (
        reply.error["message"] == "/etc/systemd/system/koala.service exists and does not belong to swarm new"
    )
    assert host.outside() == before


def test_a_host_without_systemd_is_refused(host: FakeHost) -> None:
    (host.prefix / "run/systemd/system").rmdir()

    assert host.apply(OLD).error["message"] == "this host does not run systemd"


def test_once_begun_a_deploy_outlives_its_connection(old: FakeHost) -> None:
    (old.prefix / "slow").touch()
    with old.begin(request_for(NEW, **CHANGE), payload_of(NEW)) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line.strip() and decode(line.strip()).get("note", "").startswith("stopping"):
                break
        process.stdout.close()
        process.send_signal(signal.SIGHUP)
        process.wait(PATIENCE)

    runs(old, NEW.digest, ("master", "khepera"))
    assert old.observe().transaction.state == "applied"


def test_a_deploy_that_nobody_waits_for_does_not_begin(old: FakeHost) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with old.begin(request_for(NEW, **CHANGE), payload_of(NEW), stdout=writer) as process:
        os.close(writer)
        process.wait(PATIENCE)

    assert old.calls() == []
    assert old.observe().transaction.next == OLD.digest
    assert old.apply(NEW, **CHANGE).answer["release"] == NEW.digest


def test_a_deploy_repairs_folders_that_only_root_can_read(old: FakeHost) -> None:
    """As a ``umask=0077`` for sudo leaves them."""
    folders = [old.prefix / "opt/swarm", *(old.prefix / "opt/swarm/new" / one for one in (".", "releases"))]
    for folder in folders:
        folder.chmod(0o700)
    old.apply(NEW, **CHANGE)
    assert [oct(folder.stat().st_mode & 0o777) for folder in folders] == ["0o755"] * 3


def test_a_removed_swarm_leaves_nothing(old: FakeHost) -> None:
    assert old.ask({"verb": "remove", "swarm": "new"}).answer == {"removed": True}

    assert old.outside() == {"hosts": "127.0.0.1 localhost"}
    assert old.units() == {}
    assert list((old.prefix / "opt").iterdir()) == []
    assert old.ask({"verb": "remove", "swarm": "new"}).answer == {"removed": False}


def test_removing_one_swarm_leaves_the_other(old: FakeHost) -> None:
    (old.prefix / "opt/swarm/other").mkdir()

    old.ask({"verb": "remove", "swarm": "new"})

    assert [path.name for path in (old.prefix / "opt/swarm").iterdir()] == ["other"]


@pytest.mark.parametrize("step", ["stop", "flip", "links"])
def test_a_half_deployed_swarm_can_be_removed(old: FakeHost, step: str) -> None:
    old.apply(NEW, f"after:{step}", **CHANGE)

    assert old.ask({"verb": "remove", "swarm": "new"}).answer == {"removed": True}

    assert old.outside() == {"hosts": "127.0.0.1 localhost"}
    assert old.units() == {}
