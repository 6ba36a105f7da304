"""Observing a host changes nothing and returns what a plan needs."""

from __future__ import annotations

import fcntl
import json
from dataclasses import replace
from typing import Any

import pytest
from swarm_onboard.agent import deployed, edits, lock, motion_gate, systemd
from swarm_onboard.agent.release_store import Home
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.verbs import observe

from swarmctl.render.bundle import File
from tests.onboard.agent.fakehost import NONCE, FakeHost, bundle

RELEASE = bundle("1")
APPLY = {"verb": "apply", "swarm": "new", "txid": "0" * 16, "previous": None, "next": "0" * 16}
MORE = replace(RELEASE, files=(*RELEASE.files, File("data/map.yaml", b"resolution: 0.05\n")))
FILES_ONLY: dict[str, Any] = {"previous": RELEASE.digest, "start": [], "files_only": True}
UNITS: dict[str, Any] = {"previous": RELEASE.digest, "start": [], "confirm_within": 0.0}
FIRST, SECOND = "e" * 16, "0123456789abcdef"


def test_a_fresh_host_has_nothing_and_is_left_so(host: FakeHost) -> None:
    seen = host.observe()

    assert seen.release is None
    assert seen.units == {}
    assert seen.transaction.state == ""
    assert seen.facts.systemd is True
    assert seen.facts.free_bytes > 0
    assert not list((host.prefix / "opt").iterdir())


def test_the_manifest_is_left_out_for_who_knows_it(host: FakeHost) -> None:
    host.apply(RELEASE)

    assert host.observe().manifest == RELEASE.manifest
    assert host.observe(known_release=RELEASE.digest).manifest is None


def test_units_in_the_swarms_name_of_no_release_are_left(host: FakeHost) -> None:
    units = host.prefix / "etc/systemd/system"
    (units / "swarm-new.old.service").write_text("[Service]\nExecStart=/bin/true\n")
    (units / "swarm-new.gone.timer").symlink_to("/home/ann/gone.timer")
    (units / "swarm-new.two.hub.service").symlink_to("/opt/swarm/new.two/current/units/hub.service")
    (units / "swarm-new2.old.service").write_text("")
    (units / "swarm-new.old.service.d").mkdir()
    host.apply(RELEASE)
    assert host.observe().foreign_units == ["swarm-new.gone.timer", "swarm-new.old.service"]

    removed = host.ask({"verb": "remove", "swarm": "new", "who": "someone@laptop"})

    assert [note for note in removed.notes if note.startswith("left")] == [
        "left swarm-new.gone.timer, which swarmctl did not write",
        "left swarm-new.old.service, which swarmctl did not write",
    ]
    assert (units / "swarm-new.old.service").exists()


def test_contents_come_on_request(host: FakeHost) -> None:
    host.apply(RELEASE)

    seen = host.observe(contents=True)

    assert seen.files["params/koala.yaml"] == "version: 1\n"
    assert seen.blocks == {"/etc/hosts": "10.0.0.1 pi\n"}
    assert host.observe().files == {}


def test_a_manifest_that_was_tampered_with_is_no_manifest(host: FakeHost) -> None:
    host.apply(RELEASE)
    path = host.prefix / f"opt/swarm/new/releases/{RELEASE.digest}/manifest.json"
    path.write_text(path.read_text().replace("koala", "kuala"))

    seen = host.observe()

    assert seen.drift.files == {"manifest.json": "damaged"}
    assert seen.units == {}


def test_a_changed_mode_and_a_file_made_a_link_are_drift(host: FakeHost) -> None:
    host.apply(RELEASE)
    release = host.prefix / f"opt/swarm/new/releases/{RELEASE.digest}"
    (release / "hosts").chmod(0o666)
    (release / "params/koala.yaml").unlink()
    (release / "params/koala.yaml").symlink_to("/etc/passwd")

    assert host.observe().drift.files == {"hosts": "changed", "params/koala.yaml": "changed"}


@pytest.mark.parametrize(
    "request_",
    [
        {"verb": "observe", "swarm": "../etc"},
        {"verb": "observe", "swarm": ".agent"},
        {"verb": "observe"},
        {"verb": "os", "swarm": "new"},
        {"verb": "__init__", "swarm": "new"},
        {"verb": "a.b", "swarm": "new"},
        {**APPLY, "txid": "../../x"},
        {**APPLY, "next": "x"},
        {**APPLY, "steps": [["stop", "-H evil", ""]]},
        {**APPLY, "steps": [["reload", "nginx", ""]]},
        {**APPLY, "steps": [["create", "/etc/passwd", ""]]},
        {**APPLY, "steps": "koala.service"},
        {**APPLY, "steps": [7]},
    ],
)
def test_an_invalid_request_is_an_error_and_changes_nothing(
    host: FakeHost, request_: dict[str, object]
) -> None:
    reply = host.ask(request_)

    assert reply.error["kind"] in ("refused", "protocol")
    assert host.calls() == []
    assert not list((host.prefix / "opt").iterdir())


def observed_here(host: FakeHost, monkeypatch: pytest.MonkeyPatch) -> observe.Answer:
    """The host observed in this process, so that a test can have something happen amid it."""
    for name, value in host.environment().items():
        monkeypatch.setenv(name, value)
    return observe.handle(observe.Request("new", motion=True), b"", Report(NONCE))


@pytest.mark.parametrize("change", [FILES_ONLY, UNITS], ids=["files", "units"])
@pytest.mark.parametrize(
    "where",
    [
        (Home, "current"),
        (Home, "known_manifest"),
        (Home, "releases"),
        (observe, "facts"),
        (deployed, "last_change"),
        (lock, "holder"),
        (deployed, "drift"),
        (edits, "found"),
        (systemd, "states"),
        (motion_gate, "busy"),
    ],
    ids=lambda where: where[1],
)
@pytest.mark.parametrize("after", [False, True], ids=["before", "after"])
def test_a_look_never_names_a_change_that_it_has_not_seen_whole(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], where: Any, after: bool
) -> None:
    """The lease compares the change that a look names with the last one: a plan of half of it would pass."""
    owner, name = where
    assert not host.apply(RELEASE, txid=FIRST).error
    step, done = getattr(owner, name), []

    def changed() -> None:
        if not done:
            done.append(host.apply(MORE, txid=SECOND, **change))
            assert not done[0].error

    def amid_the_change(*arguments: Any, **more: Any) -> Any:
        if not after:
            changed()
        found = step(*arguments, **more)
        changed()
        return found

    monkeypatch.setattr(owner, name, amid_the_change)
    seen = observed_here(host, monkeypatch)

    assert done
    if seen.transaction.txid == SECOND:
        assert (seen.release, seen.transaction.state) == (MORE.digest, "applied")
        assert seen.manifest == MORE.manifest
        assert not seen.drift.files


def test_a_change_of_files_that_begins_amid_a_look_is_not_undone(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not host.apply(RELEASE, txid=FIRST).error
    held = (host.prefix / "opt/swarm/new/state/lock").open("r+")
    holder, begun = lock.holder, []

    def one_begins(home: Home) -> Any:
        """Another agent gets the lock right after the look at it, and writes its record."""
        found = holder(home)
        if not begun:
            begun.append(host.apply(MORE, "after:switching", txid=SECOND, **FILES_ONLY))
            fcntl.flock(held, fcntl.LOCK_EX)
            json.dump({"who": "ann@desk (7)", "pid": 7}, held)
            held.flush()
        return found

    monkeypatch.setattr(lock, "holder", one_begins)
    with held:
        seen = observed_here(host, monkeypatch).transaction

    assert begun
    assert (seen.txid, seen.state) in [(FIRST, "applied"), (SECOND, "applying")]
