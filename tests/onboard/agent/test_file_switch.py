"""A change of files alone: old or new at one rename, without a recovery unit, and without a confirmation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarmctl.render.bundle import File
from tests.onboard.agent import fakehost
from tests.onboard.agent.fakehost import FakeHost, Reply, bundle

OLD = bundle("1")
NEW = replace(OLD, files=(*OLD.files, File("data/map.yaml", b"resolution: 0.05\n")))
FIRST, TXID = "e" * 16, "0123456789abcdef"
SCRIPT = bundle("2")


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    host = FakeHost(tmp_path)
    assert not host.apply(OLD, txid=FIRST).error
    (host.prefix / "calls").write_text("")
    return host


def switch(host: FakeHost, failpoint: str = "", **changes: Any) -> Reply:
    request = {"previous": OLD.digest, "txid": TXID, "start": [], "files_only": True}
    return host.apply(changes.pop("bundle", NEW), failpoint, **{**request, **changes})


def test_it_stays_at_once_and_starts_nothing(host: FakeHost) -> None:
    outside = host.outside()
    reply = switch(host)
    assert reply.answer == {"release": NEW.digest, "previous": OLD.digest}
    assert (host.prefix / "calls").read_text() == ""  # of no unit, that of the recovery either
    seen = host.observe()
    assert (seen.release, seen.transaction.state) == (NEW.digest, "applied")
    assert host.read("opt/swarm/new/current/data/map.yaml") == b"resolution: 0.05\n"
    assert host.outside() == outside
    assert [one.next for one in host.history()] == [OLD.digest, NEW.digest]


@pytest.mark.parametrize(("failpoint", "release"), [("after:switching", OLD), ("after:flip", NEW)])
def test_an_agent_that_dies_leaves_a_whole_release_and_the_truth(
    host: FakeHost, failpoint: str, release: Any
) -> None:
    assert switch(host, failpoint).status == 137
    seen = host.observe()
    state = "undone" if release is OLD else "applied"
    assert (seen.release, seen.transaction.state) == (release.digest, state)
    confirmed = host.ask({"verb": "confirm", "swarm": "new", "txid": TXID, "wait": 0.3})
    if release is NEW:
        assert confirmed.answer == {"release": NEW.digest}
    else:
        assert confirmed.error["message"] == "interrupted before it changed anything"
    assert not host.apply(SCRIPT, previous=release.digest, start=[], txid="f" * 16).error
    applied = [OLD.digest, *([NEW.digest] if release is NEW else []), SCRIPT.digest]
    assert [one.next for one in host.history()] == applied
    back = {"verb": "rollback", "swarm": "new", "txid": "9" * 16, "previous": SCRIPT.digest, "secrets": ""}
    assert host.ask({**back, "next": release.digest}).answer["release"] == release.digest


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"restart": ["koala.service"]}, "units or daemons change"),
        ({"reload": ["udev"]}, "units or daemons change"),
        (
            {"bundle": bundle("1", hosts="10.0.0.9 pi\n")},
            "a file changes that is shown elsewhere on the host",
        ),
        ({"bundle": bundle("1", units=("master",))}, "units, links or blocks change"),
        ({"bundle": replace(NEW, secrets=("pin",))}, "secrets change"),
    ],
)
def test_a_host_refuses_it_where_it_is_more(host: FakeHost, changes: dict[str, Any], why: str) -> None:
    reply = switch(host, **changes)
    assert why in reply.error["message"]
    assert host.observe().release == OLD.digest


def test_a_disk_that_fills_up_at_the_switch_leaves_the_old_release(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = "from swarm_onboard.agent.main"
    full = "from swarm_onboard.agent import files; "
    full += "files.point = lambda *_: exec('raise OSError(28, str(), str())'); "
    with monkeypatch.context() as patch:
        patch.setattr(fakehost, "BOOT", fakehost.BOOT.replace(first, full + first))
        assert "the disk is full" in switch(host).error["message"]
    seen = host.observe()
    assert (seen.release, seen.transaction.state) == (OLD.digest, "undone")
    assert switch(host, txid="f" * 16).answer["release"] == NEW.digest


def test_a_host_refuses_it_where_a_link_is_astray(host: FakeHost) -> None:
    (host.prefix / "etc/udev/rules.d/90-swarm-new.rules").unlink()
    assert "/etc/udev/rules.d/90-swarm-new.rules is not as deployed" in switch(host).error["message"]
