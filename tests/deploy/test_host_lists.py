"""Another operator learns from the hosts of a swarm which ones left it; what a host that lies cannot do."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from typing import Any

import pytest
from swarm_onboard.agent.host_list import HostLogin

from swarmctl.deploy.host_lists import HostLists
from swarmctl.deploy.rollout import observe
from swarmctl.render.bundle import Bundle
from tests.deploy import test_rollout as rollouts
from tests.deploy.deploying import deploy
from tests.onboard.agent.fakehost import FakeHost

hosts = rollouts.hosts
LIST = "opt/swarm/new/state/hosts.json"
LOGINS: dict[str, HostLogin] = {
    name: HostLogin(f"192.0.2.{number}", "robot", 22, None, []) for number, name in enumerate(rollouts.HOSTS)
}
KEPT = {name: one._asdict() for name, one in LOGINS.items()}


def of(*names: str) -> HostLists:
    return HostLists("new", {name: LOGINS[name] for name in names})


def deployed(hosts: Mapping[str, FakeHost], lists: HostLists, only: tuple[str, ...] = ()) -> None:
    wanted = {name: one for name, one in rollouts.bundles().items() if name in (only or lists.spec)}
    transport = rollouts.FolderTransport(hosts, {})
    rollouts.deployed(deploy(wanted, rollouts.TARGETS, transport, host_lists=lists))


def observed(hosts: Mapping[str, FakeHost], lists: HostLists) -> Mapping[str, HostLogin]:
    wanted: dict[str, Bundle] = {name: one for name, one in rollouts.bundles().items() if name in lists.spec}
    observe(wanted, rollouts.TARGETS, rollouts.FolderTransport(hosts, {}), host_lists=lists, parallel=4)
    return lists.left


def stored(hosts: Mapping[str, FakeHost]) -> dict[str, Any]:
    return {
        name: json.loads(host.read(LIST)) for name, host in hosts.items() if (host.prefix / LIST).exists()
    }


def test_another_operator_is_shown_the_host_that_left(hosts: dict[str, FakeHost]) -> None:
    deployed(hosts, of(*rollouts.HOSTS))
    before = stored(hosts)
    assert [one["hosts"] for one in before.values()] == [KEPT] * 3

    lists = of("leader", "k3")
    assert observed(hosts, lists) == {"epuck": LOGINS["epuck"]}
    assert lists.source("epuck") in ("leader", "k3")
    deployed(hosts, of("leader", "k3"))
    assert stored(hosts) == before  # the host that left is not forgotten, and nothing is written again
    deployed(hosts, of(*rollouts.HOSTS))
    assert stored(hosts) == before


def test_a_new_host_reaches_the_lists_of_the_others(hosts: dict[str, FakeHost]) -> None:
    deployed(hosts, of("leader", "k3"))
    deployed(hosts, of(*rollouts.HOSTS), only=("epuck",))
    assert set(stored(hosts)["leader"]["hosts"]) == {"leader", "k3"}  # --limit: the others come later
    assert stored(hosts)["epuck"]["hosts"] == KEPT  # what it did not look at may well be deployed
    deployed(hosts, of(*rollouts.HOSTS))
    assert [one["hosts"] for one in stored(hosts).values()] == [KEPT] * 3


def test_a_host_that_was_taken_off_the_list_of_one_is_in_none(hosts: dict[str, FakeHost]) -> None:
    deployed(hosts, of(*rollouts.HOSTS))
    newer = json.loads(hosts["k3"].read(LIST))
    del newer["hosts"]["epuck"]
    newer["epoch"] += 1
    for gone, left in (({}, {"epuck"}), ({"epuck": newer["epoch"]}, set())):
        (hosts["k3"].prefix / LIST).write_text(json.dumps({**newer, "gone": gone}))
        assert set(observed(hosts, of("leader", "k3"))) == left
    deployed(hosts, of("leader", "k3"))
    assert [set(stored(hosts)[name]["hosts"]) for name in ("leader", "k3")] == [{"leader", "k3"}] * 2


@pytest.mark.parametrize(
    "lie",
    [
        {"address": LOGINS["leader"].address},  # a host of the spec under another name
        {"address": "192.0.2.9; touch /tmp/x"},
        {"address": "-oProxyCommand=x"},
        {"user": "$(id)"},
        {"port": 0},
        {"via": "../x"},
    ],
)
def test_an_entry_that_no_spec_could_have_is_ignored(hosts: dict[str, FakeHost], lie: dict[str, Any]) -> None:
    deployed(hosts, of(*rollouts.HOSTS))
    names = {**KEPT, "ghost": {**KEPT["epuck"], "address": "192.0.2.9", **lie}}
    (hosts["k3"].prefix / LIST).write_text(
        json.dumps({"epoch": int(time.time()) + 9, "hosts": names, "gone": {}})
    )
    assert set(observed(hosts, of("leader", "k3"))) == {"epuck"}


def test_a_list_of_the_far_future_does_not_win(hosts: dict[str, FakeHost]) -> None:
    deployed(hosts, of(*rollouts.HOSTS))
    (hosts["k3"].prefix / LIST).write_text(
        json.dumps({"epoch": 1 << 60, "hosts": {}, "gone": {"epuck": 1 << 60}})
    )
    lists = of("leader", "k3")
    assert set(observed(hosts, lists)) == {"epuck"}
    assert lists.epoch < time.time() + 60


@pytest.mark.parametrize("answer", ["[]", '{"epoch": 3, "hosts": {"x": 1}, "gone": {}}'])
def test_a_list_that_is_none_costs_nothing(hosts: dict[str, FakeHost], answer: str) -> None:
    deployed(hosts, of(*rollouts.HOSTS))
    (hosts["k3"].prefix / LIST).write_text(answer)
    assert set(observed(hosts, of("leader", "k3"))) == {"epuck"}
