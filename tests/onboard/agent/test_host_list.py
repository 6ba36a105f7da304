"""The list of the swarm's hosts on one of them: beside its release, replaced by newer ones alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.host_list import digest_of

from tests.onboard.agent.fakehost import FakeHost, Reply
from tests.onboard.agent.test_observe import RELEASE

PI = {"address": "192.0.2.7", "user": "ann", "port": 22, "via": None, "declared": []}
LIST = "opt/swarm/new/state/hosts.json"


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    made = FakeHost(tmp_path / "host")
    made.apply(RELEASE)
    return made


def store(host: FakeHost, epoch: int, *names: str, **more: Any) -> Reply:
    hosts = dict.fromkeys(names, PI)
    return host.ask(
        {"verb": "host_list", "swarm": "new", "who": "ann", "epoch": epoch, "hosts": hosts, **more}
    )


def test_the_newest_list_counts_and_is_no_part_of_the_release(host: FakeHost) -> None:
    before = host.observe()
    assert before.host_list is None
    assert store(host, 5, "a", "b").answer == {"epoch": 5, "hosts": {"a": PI, "b": PI}, "gone": {}}
    assert store(host, 5, "c").answer["hosts"].keys() == {"a", "b"}
    assert store(host, 4, "c").answer["hosts"].keys() == {"a", "b"}
    after = host.observe()
    assert after.host_list == (5, digest_of({"b": PI, "a": PI}, {}))
    assert (after.release, after.drift) == (before.release, before.drift)
    host.ask({"verb": "remove", "swarm": "new", "who": "ann"})
    assert not (host.prefix / "opt/swarm/new").exists()


def test_a_host_without_the_swarm_stores_nothing(tmp_path: Path) -> None:
    host = FakeHost(tmp_path / "host")
    assert store(host, 5, "a").answer == {"epoch": 0, "hosts": {}, "gone": {}}
    assert not (host.prefix / "opt/swarm").exists()


@pytest.mark.parametrize(
    "text", ["{", "3", '{"epoch": "x", "hosts": {}, "gone": {}}', '{"epoch": 1, "hosts": []}']
)
def test_a_damaged_list_is_replaced(host: FakeHost, text: str) -> None:
    (host.prefix / LIST).write_text(text)
    assert host.ask({"verb": "host_list", "swarm": "new"}).answer == {"epoch": 0, "hosts": {}, "gone": {}}
    assert store(host, 1, "a").answer["hosts"].keys() == {"a"}


def test_forgotten_hosts_are_in_the_history(host: FakeHost) -> None:
    store(host, 5, "a", forgotten=["old-pi"], txid="f" * 16)
    store(host, 5, "a", forgotten=["other"], txid="e" * 16)  # not stored, so not logged
    entries = host.history()
    last = entries[-1]
    assert (last.state, last.error, last.who, last.run) == ("forgotten", "old-pi", "ann", "f" * 16)
    assert last.previous == last.next == RELEASE.digest
    assert "e" * 16 not in [one.txid for one in entries]
