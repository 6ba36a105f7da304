"""Observing a host changes nothing and returns what a plan needs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.onboard.agent.fakehost import FakeHost, bundle

RELEASE = bundle("1")


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    return FakeHost(tmp_path)


def test_a_fresh_host_has_nothing_and_is_left_so(host: FakeHost) -> None:
    seen = host.observe()

    assert seen["release"] is None
    assert seen["units"] == {}
    assert seen["transaction"]["state"] == ""
    assert seen["facts"]["systemd"] is True
    assert seen["facts"]["free_bytes"] > 0
    assert not list((host.prefix / "opt").iterdir())


def test_the_manifest_is_left_out_for_who_knows_it(host: FakeHost) -> None:
    host.apply(RELEASE)

    assert host.observe()["manifest"] == RELEASE.manifest
    assert "manifest" not in host.observe(known_release=RELEASE.digest)


def test_units_in_the_swarms_name_of_no_release_are_left(host: FakeHost) -> None:
    units = host.prefix / "etc/systemd/system"
    (units / "swarm-new.old.service").write_text("[Service]\nExecStart=/bin/true\n")
    (units / "swarm-new.gone.timer").symlink_to("/home/ann/gone.timer")
    (units / "swarm-new.two.hub.service").symlink_to("/opt/swarm/new.two/current/units/hub.service")
    (units / "swarm-new2.old.service").write_text("")
    (units / "swarm-new.old.service.d").mkdir()
    host.apply(RELEASE)
    assert host.observe()["foreign_units"] == ["swarm-new.gone.timer", "swarm-new.old.service"]

    removed = host.ask({"verb": "remove", "swarm": "new", "who": "someone@laptop"})

    assert [note for note in removed.notes if note.startswith("left")] == [
        "left swarm-new.gone.timer, which swarmctl did not write",
        "left swarm-new.old.service, which swarmctl did not write",
    ]
    assert (units / "swarm-new.old.service").exists()


def test_contents_come_on_request(host: FakeHost) -> None:
    host.apply(RELEASE)

    seen = host.observe(contents=True)

    assert seen["files"]["params/koala.yaml"] == "version: 1\n"
    assert seen["blocks"] == {"/etc/hosts": "10.0.0.1 pi\n"}
    assert "files" not in host.observe()


def test_a_manifest_that_was_tampered_with_is_no_manifest(host: FakeHost) -> None:
    host.apply(RELEASE)
    path = host.prefix / f"opt/swarm/new/releases/{RELEASE.digest}/manifest.json"
    path.write_text(path.read_text().replace("koala", "kuala"))

    seen = host.observe()

    assert seen["drift"]["files"] == {"manifest.json": "damaged"}
    assert seen["units"] == {}


def test_a_changed_mode_and_a_file_made_a_link_are_drift(host: FakeHost) -> None:
    host.apply(RELEASE)
    release = host.prefix / f"opt/swarm/new/releases/{RELEASE.digest}"
    (release / "hosts").chmod(0o666)
    (release / "params/koala.yaml").unlink()
    (release / "params/koala.yaml").symlink_to("/etc/passwd")

    assert host.observe()["drift"]["files"] == {"hosts": "changed", "params/koala.yaml": "changed"}


@pytest.mark.parametrize(
    "request_",
    [
        {"verb": "observe", "swarm": "../etc"},
        {"verb": "observe", "swarm": ".agent"},
        {"verb": "observe"},
        {"verb": "os", "swarm": "new"},
        {"verb": "__init__", "swarm": "new"},
        {"verb": "a.b", "swarm": "new"},
        {"verb": "apply", "swarm": "new", "txid": "../../x", "next": "0" * 16},
        {"verb": "apply", "swarm": "new", "txid": "0" * 16, "next": "x"},
        {"verb": "apply", "swarm": "new", "txid": "0" * 16, "next": "0" * 16, "stop": ["-H evil"]},
        {"verb": "apply", "swarm": "new", "txid": "0" * 16, "next": "0" * 16, "start": "koala.service"},
    ],
)
def test_an_invalid_request_is_an_error_and_changes_nothing(
    host: FakeHost, request_: dict[str, object]
) -> None:
    reply = host.ask(request_)

    assert reply.error["kind"] in ("refused", "protocol")
    assert host.calls() == []
    assert not list((host.prefix / "opt").iterdir())
