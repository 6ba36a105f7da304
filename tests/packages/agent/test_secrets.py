"""Secrets: kept for root alone, compared on the host, in no answer and no record, gone with their need."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.packages.agent.fakehost import FakeHost, bundle

PIN = "49714971"  # longer than any process id, which the lock file has
PLAIN = bundle("1")
PAIRED = replace(PLAIN, secrets=("epuck-pin",))
VAULT = "etc/swarm/new/secrets"


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    return FakeHost(tmp_path)


def keep(host: FakeHost, **values: str) -> None:
    payload = json.dumps({name.replace("_", "-"): value for name, value in values.items()}).encode()
    reply = host.ask({"verb": "keep_secrets", "swarm": "new"}, payload)
    assert not reply.error
    assert PIN not in json.dumps(reply.answer)


def compared(host: FakeHost, value: str | None) -> str:
    payload = json.dumps({} if value is None else {"epuck-pin": value}).encode()
    reply = host.ask({"verb": "observe", "swarm": "new", "secrets": ["epuck-pin"]}, payload)
    assert PIN not in json.dumps(reply.answer)
    return str(reply.answer["secrets"]["epuck-pin"])


def test_only_root_can_read_it(host: FakeHost) -> None:
    keep(host, epuck_pin=PIN)
    assert (host.prefix / VAULT / "epuck-pin").read_text() == PIN
    assert (host.prefix / VAULT / "epuck-pin").stat().st_mode & 0o777 == 0o600
    assert (host.prefix / VAULT).stat().st_mode & 0o777 == 0o700


def test_the_host_reports_only_how_secrets_compare(host: FakeHost) -> None:
    assert compared(host, None) == "missing"
    assert compared(host, PIN) == "new"
    keep(host, epuck_pin=PIN)
    assert compared(host, PIN) == "same"
    assert compared(host, "0000") == "other"
    assert compared(host, None) == "kept"


def test_it_stays_as_long_as_a_release_needs_it(host: FakeHost) -> None:
    keep(host, epuck_pin=PIN)
    assert host.apply(PAIRED).answer["release"] == PAIRED.digest
    assert (host.prefix / VAULT / "epuck-pin").exists()
    host.apply(PLAIN, base=PAIRED.digest, start=[])
    before = PLAIN
    for following in (bundle("7"), bundle("8")):
        assert (host.prefix / VAULT / "epuck-pin").exists()  # a rollback would need it
        host.apply(following, base=before.digest, start=[])
        before = following
    assert not (host.prefix / "etc/swarm").exists()


@pytest.mark.parametrize("failpoint", ["", "error:start"])
def test_removed_or_undone_it_is_gone(host: FakeHost, failpoint: str) -> None:
    keep(host, epuck_pin=PIN)
    host.apply(PAIRED, failpoint=failpoint)
    if not failpoint:
        host.ask({"verb": "remove", "swarm": "new"})
    assert not (host.prefix / "etc/swarm").exists()


def test_no_file_of_the_swarms_folder_holds_it(host: FakeHost) -> None:
    keep(host, epuck_pin=PIN)
    host.apply(PAIRED)
    for path in (host.prefix / "opt").rglob("*"):
        assert path.is_symlink() or path.is_dir() or PIN.encode() not in path.read_bytes()


@pytest.mark.parametrize("name", ["../../passwd", "", "a/b", "A", ".x"])
def test_a_name_that_is_no_name_is_refused(host: FakeHost, name: str) -> None:
    reply = host.ask({"verb": "keep_secrets", "swarm": "new"}, json.dumps({name: PIN}).encode())
    assert reply.error["kind"] == "refused"
    assert not (host.prefix / "etc/swarm").exists()
