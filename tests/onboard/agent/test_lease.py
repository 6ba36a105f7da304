"""One run of swarmctl at a time changes a host; what an earlier run still sends is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.onboard.agent.fakehost import FakeHost, bundle, payload_of, request_for

OLD, NEW = bundle("1"), bundle("2")
TXID = "0123456789abcdef"
ANNA, BEN = "a" * 16, "b" * 16
RUNS = {"anna": ANNA, "ben": BEN}


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    return FakeHost(tmp_path)


def lease(host: FakeHost, run: str, *, want: bool = True, **more: Any) -> dict[str, Any]:
    request = {
        "verb": "lease", "swarm": "new", "run": RUNS[run], "who": f"{run}@desk (7)", "want": want, **more
    }  # fmt: skip
    answer = host.ask(request).answer
    assert answer is not None
    return answer


def applied(host: FakeHost, **more: Any) -> str:
    """Returns the error of a deploy to an empty host; empty if there was none."""
    reply = host.ask(request_for(OLD, previous=None, txid=TXID, **more), payload_of(OLD))
    return str(reply.error["message"]) if reply.error else ""


def expire(host: FakeHost) -> None:
    path = host.prefix / "opt/swarm/new/state/lease.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "until": 0}))


def test_a_second_run_learns_who_has_the_lease(host: FakeHost) -> None:
    assert lease(host, "anna")["granted"]
    second = lease(host, "ben")
    assert (second["granted"], second["who"]) == (False, "anna@desk (7)")
    assert 50 < second["left"] <= 60
    assert applied(host) == "locked by anna@desk (7)"
    assert not (host.prefix / "opt/swarm/new/current").exists()
    assert applied(host, run=ANNA) == ""


def test_a_lease_that_was_given_back_is_free(host: FakeHost) -> None:
    lease(host, "anna")
    assert not lease(host, "ben", want=False)["granted"]
    assert not lease(host, "ben")["granted"]
    lease(host, "anna", want=False)
    assert applied(host) == ""
    assert lease(host, "ben")["granted"]


@pytest.mark.parametrize("end", ["time", "boot", "broken"])
def test_a_run_whose_lease_another_one_took_changes_nothing(host: FakeHost, end: str) -> None:
    lease(host, "anna")
    if end == "time":
        expire(host)
    elif end == "boot":
        host.boot(1)
    taken = lease(host, "ben", breaks=ANNA if end == "broken" else "")
    assert (taken["granted"], taken["epoch"]) == (True, 2)

    assert applied(host, run=ANNA) == "the lease of this run has ended: ben@desk (7) has it"
    assert not lease(host, "anna")["granted"]
    assert applied(host, run=BEN) == ""


def test_a_late_run_may_go_on_while_nobody_else_came(host: FakeHost) -> None:
    lease(host, "anna")
    expire(host)
    assert applied(host, run=ANNA) == ""
    assert not lease(host, "ben")["granted"]  # the change has renewed it


def test_a_lease_ends_with_the_boot(host: FakeHost) -> None:
    lease(host, "anna")
    host.boot(1)
    refusal = "the lease of this run has ended: others may have changed the host since"
    assert applied(host, run=ANNA) == refusal


def test_a_renewal_moves_the_deadline_of_its_pending_change(host: FakeHost) -> None:
    lease(host, "anna")
    assert applied(host, run=ANNA, confirm_within=5) == ""
    assert host.observe().transaction.left < 6
    renewed = lease(host, "anna", pending=TXID, confirm_within=100)
    assert renewed["epoch"] == 1
    assert host.observe().transaction.left > 90
    lease(host, "anna", pending="f" * 16, confirm_within=1000)
    assert host.observe().transaction.left < 101


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"epoch": 3}', '{"epoch": "x", "run": 1}'])
def test_a_damaged_lease_is_none(host: FakeHost, damage: str) -> None:
    lease(host, "anna")
    (host.prefix / "opt/swarm/new/state/lease.json").write_text(damage)
    assert lease(host, "ben")["granted"]
