"""Hosts go back to releases that they have kept; their logs say who changed what."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from swarmctl.deploy.host_records import histories
from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.outcome import Outcome, Rules
from swarmctl.deploy.rollback import Rollback
from swarmctl.plan.history import Run, runs
from swarmctl.plan.waves import order
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind
from swarmctl.views.history import history_text
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import HOSTS, TARGETS, FolderTransport, bundles, changed, deployed, hosts
from tests.onboard.agent.fakehost import FakeHost

__all__ = ["hosts"]


def put(hosts: Mapping[str, FakeHost], **params: str) -> None:
    results = deployed(deploy(bundles(**params), TARGETS, FolderTransport(hosts, {})))
    assert all(isinstance(one, Outcome) for one in results.values()), results


def back(
    hosts: Mapping[str, FakeHost], to: str = "", **broken: Exception
) -> tuple[dict[str, Outcome | HostError], str]:
    """Returns the results of a rollback, and why there is no way back."""
    rules = Rules(0, (), Terms(healthy_for=0.1, healthy_within=5))
    with Rollback(
        bundles(), TARGETS, FolderTransport(hosts, broken), to=to, rules=rules, parallel=4
    ) as going:
        for _ in going.survey():
            pass
        return deployed(going.change(order(going.due, (), ("100%",), "all"))), going.problem


def logged(hosts: Mapping[str, FakeHost]) -> list[Run]:
    events = histories("new", list(TARGETS.values()), FolderTransport(hosts, {}), parallel=3)
    found: Any = {event.host: event.outcome.entries for event in events if isinstance(event, Finished)}
    return runs(found)


def speeds(hosts: Mapping[str, FakeHost]) -> dict[str, str]:
    path = "opt/swarm/new/current/params/robot.yaml"
    return {name: host.read(path).decode().split()[1] for name, host in hosts.items()}


def test_hosts_of_the_last_run_go_back_and_the_others_stay(hosts: dict[str, FakeHost]) -> None:
    put(hosts)
    put(hosts, leader="speed: 5\n")
    put(hosts, k3="speed: 2\n", epuck="speed: 3\n", leader="speed: 5\n")

    results, problem = back(hosts)

    assert (changed(results), problem) == ({"leader": False, "k3": True, "epuck": True}, "")
    assert speeds(hosts) == {"leader": "5", "k3": "1", "epuck": "1"}
    assert set(hosts["k3"].units().values()) == {bundles()["k3"].digest}
    again, _ = back(hosts)  # the rollback itself was the last run
    assert changed(again) == {"leader": False, "k3": True, "epuck": True}
    assert speeds(hosts) == {"leader": "5", "k3": "2", "epuck": "3"}


def test_all_hosts_go_back_to_the_state_after_a_run(hosts: dict[str, FakeHost]) -> None:
    put(hosts)
    put(hosts, leader="speed: 5\n")
    put(hosts, k3="speed: 2\n", leader="speed: 5\n")
    first, second, _ = logged(hosts)

    back(hosts, first.name[:6])
    assert speeds(hosts) == dict.fromkeys(HOSTS, "1")
    back(hosts, second.name)
    assert speeds(hosts) == {"leader": "5", "k3": "1", "epuck": "1"}
    back(hosts, bundles(k3="speed: 2\n")["k3"].digest)
    assert speeds(hosts) == {"leader": "5", "k3": "2", "epuck": "1"}


@pytest.mark.parametrize(
    ("deploys", "to", "problem"),
    [
        (0, "", "no host has a change that could be taken back"),
        (1, "", "it was the first deploy of epuck, k3, leader"),
        (1, "ffff", "`ffff` is not a run of the history"),
        (2, "", ""),
    ],
)
def test_without_a_way_back_nothing_changes(
    hosts: dict[str, FakeHost], deploys: int, to: str, problem: str
) -> None:
    for number in range(deploys):
        put(hosts, **dict.fromkeys(HOSTS, f"speed: {number}\n"))
    results, found = back(hosts, to)
    assert found == problem
    assert set(changed(results).values()) == {not problem}


def test_a_release_that_was_removed_is_no_way_back(hosts: dict[str, FakeHost]) -> None:
    for number in range(5):  # the host keeps three
        put(hosts, **dict.fromkeys(HOSTS, f"speed: {number}\n"))
    results, _ = back(hosts, logged(hosts)[0].name)
    assert set(changed(results).values()) == {Kind.UNFIT}
    assert "is not on the host any more" in str(results["k3"])
    assert set(speeds(hosts).values()) == {"4"}


def test_all_hosts_go_back_or_none(hosts: dict[str, FakeHost]) -> None:
    put(hosts)
    put(hosts, **dict.fromkeys(HOSTS, "speed: 2\n"))
    away = HostError(Kind.UNREACHABLE, "no route")
    assert changed(back(hosts, k3=away)[0]) == {
        "leader": Kind.HELD,
        "k3": Kind.UNREACHABLE,
        "epuck": Kind.HELD,
    }

    (hosts["k3"].prefix / f"broken-new.robot.service-{bundles()['k3'].digest}").touch()
    assert changed(back(hosts)[0]) == {"leader": Kind.HELD, "k3": Kind.FAILED, "epuck": Kind.HELD}
    assert set(speeds(hosts).values()) == {"2"}


def test_the_history_names_who_changed_what_and_what_was_undone(hosts: dict[str, FakeHost]) -> None:
    put(hosts)
    (hosts["k3"].prefix / f"broken-new.robot.service-{bundles(k3='speed: 2')['k3'].digest}").touch()
    deployed(deploy(bundles(k3="speed: 2", epuck="speed: 2"), TARGETS, FolderTransport(hosts, {})))

    first, second = logged(hosts)

    assert set(first.changes) == set(HOSTS)
    assert {host: one.state for host, one in second.changes.items()} == {
        "k3": "undone",
        "epuck": "applied",
    }
    assert first.name != second.name
    text = history_text([first, second], {"pi": HostError(Kind.UNREACHABLE, "no route")}, None).plain
    assert text.index(second.name[:8]) < text.index(first.name[:8])
    assert f"  k3  {bundles()['k3'].digest} -> {bundles(k3='speed: 2')['k3'].digest}, undone: " in text
    assert "pi  unreachable: no route" in text
    assert f"  {second.who.partition(' (')[0]}\n" in text


@pytest.mark.parametrize("line", ["", "{", "[]", '{"txid": 1}', '{"txid": "a", "time": "x"}', "\x00"])
def test_a_damaged_line_of_the_log_costs_only_itself(hosts: dict[str, FakeHost], line: str) -> None:
    put(hosts)
    log = hosts["k3"].prefix / "opt/swarm/new/state/audit.jsonl"
    log.write_text(line + "\n" + log.read_text() + log.read_text())
    assert len(logged(hosts)) == 1
    put(hosts, k3="speed: 2\n")
    assert len(logged(hosts)) == 2
