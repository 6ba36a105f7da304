"""A deploy in waves: what the failure of some hosts means for the others."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from swarmctl.deploy.host_transaction import HostTransaction, Terms
from swarmctl.remote.connections import Connections
from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.bundle import Bundle, File
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import (
    HOSTS,
    TARGETS,
    FolderTransport,
    bundles,
    changed,
    deployed,
    hosts,
    hosts_in,
)
from tests.onboard.agent.fakehost import FakeHost

__all__ = ["hosts"]
FAST = dict.fromkeys(HOSTS, "speed: 2\n")


def breaks(host: FakeHost) -> None:
    """Has the unit of the next release fail."""
    (host.prefix / f"broken-new.robot.service-{bundles(**FAST)['k3'].digest}").touch()


@pytest.fixture
def deployed_hosts(hosts: dict[str, FakeHost]) -> dict[str, FakeHost]:
    deployed(deploy(bundles(), TARGETS, FolderTransport(hosts, {})))
    return hosts


def speeds(hosts: Mapping[str, FakeHost]) -> dict[str, str]:
    return {
        name: host.read("opt/swarm/new/current/params/robot.yaml").decode().split()[1]
        for name, host in hosts.items()
    }


def test_after_a_failed_canary_no_other_host_changes(deployed_hosts: dict[str, FakeHost]) -> None:
    breaks(deployed_hosts["k3"])
    way = FolderTransport(deployed_hosts, {})
    results = deployed(deploy(bundles(**FAST), TARGETS, way, most_failed=0, serial=("1",)))
    assert changed(results) == {"leader": True, "k3": Kind.FAILED, "epuck": Kind.HELD}
    assert str(results["epuck"]) == "the rollout has stopped before it, since k3 failed"
    assert speeds(deployed_hosts) == {"leader": "2", "k3": "1", "epuck": "1"}


def test_as_many_hosts_may_fail_as_the_operator_says(deployed_hosts: dict[str, FakeHost]) -> None:
    breaks(deployed_hosts["k3"])
    way = FolderTransport(deployed_hosts, {})
    results = deployed(deploy(bundles(**FAST), TARGETS, way, most_failed=1, serial=("1",)))
    assert changed(results) == {"epuck": True, "k3": Kind.FAILED, "leader": True}


def test_three_of_twenty_failures_stop_a_rollout_that_may_have_two(tmp_path: Path) -> None:
    names = [f"h{number:02d}" for number in range(20)]
    way = FolderTransport(hosts_in(tmp_path, names), {})
    wanted = {name: replace(bundles()["k3"], host=name) for name in names}
    targets = {name: replace(TARGETS["k3"], host=name) for name in names}
    for name in ("h01", "h05", "h07"):
        (way.hosts[name].prefix / f"broken-new.robot.service-{wanted[name].digest}").touch()

    results = deployed(deploy(wanted, targets, way, most_failed=2, serial=("5",), parallel=4))

    failed = dict.fromkeys(("h01", "h05", "h07"), Kind.FAILED)
    assert changed(results) == {
        **dict.fromkeys(names[:10], True), **dict.fromkeys(names[10:], Kind.HELD), **failed,
    }  # fmt: skip
    assert {str(results[name]) for name in names[10:]} == {
        "the rollout has stopped before it, since h[01,05,07] failed"
    }
    for name in names:
        released = way.hosts[name].observe().release
        assert (released == wanted[name].digest) is (changed(results)[name] is True), name


def test_hosts_that_belong_together_go_back_together(deployed_hosts: dict[str, FakeHost]) -> None:
    breaks(deployed_hosts["k3"])
    way = FolderTransport(deployed_hosts, {})
    results = deployed(deploy(bundles(**FAST), TARGETS, way, most_failed=0, consistency="all"))
    assert changed(results) == {"epuck": Kind.HELD, "k3": Kind.FAILED, "leader": Kind.HELD}
    old = bundles()["epuck"].digest
    assert str(results["epuck"]) == f"it was changed and is back at release {old}, since k3 failed"
    assert set(speeds(deployed_hosts).values()) == {"1"}
    states = {host.observe().transaction.state for host in deployed_hosts.values()}
    assert states == {"undone"}


def test_hosts_that_belong_together_stay_together(deployed_hosts: dict[str, FakeHost]) -> None:
    way = FolderTransport(deployed_hosts, {})
    results = deployed(deploy(bundles(**FAST), TARGETS, way, most_failed=0, consistency="all"))
    assert changed(results) == dict.fromkeys(HOSTS, True)
    assert {host.observe().transaction.state for host in deployed_hosts.values()} == {"applied"}


def test_a_run_that_dies_between_confirmations_is_finished(
    deployed_hosts: dict[str, FakeHost], monkeypatch: pytest.MonkeyPatch
) -> None:
    confirm = HostTransaction.confirm

    def dies(self: HostTransaction, txid: str) -> None:
        if self.bundle.host != "leader":
            raise HostError(Kind.LOST, "the operator was killed")
        confirm(self, txid)

    way = FolderTransport(deployed_hosts, {})
    with monkeypatch.context() as patch:
        patch.setattr(HostTransaction, "confirm", dies)
        terms = Terms(healthy_for=0.1, healthy_within=5, confirm_within=2)
        split = deployed(deploy(bundles(**FAST), TARGETS, way, consistency="all", terms=terms))
    assert changed(split) == {"leader": True, "k3": Kind.LOST, "epuck": Kind.LOST}
    for name in ("k3", "epuck"):
        assert deployed_hosts[name].recover() == 0  # goes back at its deadline
    assert speeds(deployed_hosts) == {"leader": "2", "k3": "1", "epuck": "1"}

    results = deployed(deploy(bundles(**FAST), TARGETS, way, most_failed=0, consistency="all"))

    assert changed(results) == {"leader": False, "k3": True, "epuck": True}
    assert set(speeds(deployed_hosts).values()) == {"2"}


def test_every_host_gives_its_lease_back(deployed_hosts: dict[str, FakeHost]) -> None:
    way = FolderTransport(deployed_hosts, {})
    for release in (bundles(**FAST), bundles()):
        deployed(deploy(release, TARGETS, way, most_failed=0))
        for host in deployed_hosts.values():
            assert json.loads(host.read("opt/swarm/new/state/lease.json"))["run"] == ""


def test_a_locked_host_stops_all_and_names_who_locks_it(deployed_hosts: dict[str, FakeHost]) -> None:
    held = {"verb": "lease", "swarm": "new", "run": "a" * 16, "who": "ann@desk (7)", "want": True}
    assert deployed_hosts["leader"].ask(held).answer["granted"]
    way = FolderTransport(deployed_hosts, {})
    results = deployed(deploy(bundles(**FAST), TARGETS, way, most_failed=None))
    assert changed(results) == {"leader": Kind.REFUSED, "k3": Kind.HELD, "epuck": Kind.HELD}
    assert str(results["leader"]) == "locked by ann@desk (7)"
    assert str(results["k3"]) == "nothing was changed, since leader is locked by ann@desk (7)"
    assert set(speeds(deployed_hosts).values()) == {"1"}
    again = deployed(
        deploy(bundles(k3="speed: 2\n"), TARGETS, way)
    )  # k3 has given its lease back, leader not
    assert changed(again)["k3"] is Kind.HELD


def with_maps(hosts: Mapping[str, FakeHost]) -> dict[str, Bundle]:
    """Releases with one more file, which nothing uses by itself."""
    more = File("data/map.yaml", b"resolution: 0.05\n")
    return {name: replace(one, files=(*one.files, more)) for name, one in bundles().items() if name in hosts}


def test_files_that_nothing_uses_need_no_second_login(
    deployed_hosts: dict[str, FakeHost], monkeypatch: pytest.MonkeyPatch
) -> None:
    def log_in(*_: object) -> None:
        raise AssertionError("a second login")

    monkeypatch.setattr(Connections, "log_in", log_in)
    way = FolderTransport(deployed_hosts, {})
    wanted = with_maps(deployed_hosts)
    assert changed(deployed(deploy(wanted, TARGETS, way))) == dict.fromkeys(HOSTS, True)
    for name, host in deployed_hosts.items():
        seen = host.observe()
        assert (seen.release, seen.transaction.state) == (wanted[name].digest, "applied")


@pytest.mark.parametrize(
    ("failpoint", "expected"), [("after:switching", Kind.FAILED), ("after:flip", True), ("after:done", True)]
)
def test_a_host_whose_agent_dies_is_asked_what_came_of_it(
    deployed_hosts: dict[str, FakeHost],
    monkeypatch: pytest.MonkeyPatch,
    failpoint: str,
    expected: Kind | bool,
) -> None:
    environment = FakeHost.environment
    monkeypatch.setattr(FakeHost, "environment", lambda host: environment(host, failpoint))
    way = FolderTransport(deployed_hosts, {})
    wanted = with_maps({"k3": deployed_hosts["k3"]})
    found = deployed(deploy(wanted, TARGETS, way))
    assert changed(found) == {"k3": expected}
    monkeypatch.undo()
    now = wanted["k3"] if expected is True else bundles()["k3"]
    assert deployed_hosts["k3"].observe().release == now.digest


def test_hosts_that_belong_together_keep_files_alone_together(deployed_hosts: dict[str, FakeHost]) -> None:
    breaks(deployed_hosts["k3"])
    wanted = {**with_maps(deployed_hosts), "k3": bundles(**FAST)["k3"]}
    way = FolderTransport(deployed_hosts, {})
    results = deployed(deploy(wanted, TARGETS, way, most_failed=0, consistency="all"))
    assert changed(results) == {"epuck": Kind.HELD, "k3": Kind.FAILED, "leader": Kind.HELD}
    assert deployed_hosts["leader"].observe().release == bundles()["leader"].digest
