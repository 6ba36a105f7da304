"""Several operators deploy to the same hosts at once: one changes all of them, or none does."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import re
import signal
import threading
import time
from collections.abc import Mapping
from typing import Any

import pytest

from swarmctl.deploy.deployment import Deployment
from swarmctl.deploy.outcome import Outcome
from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.bundle import Bundle
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import HOSTS, TARGETS, FolderTransport, bundles, deployed, hosts
from tests.onboard.agent.fakehost import FakeHost, message_for
from tests.timing import PATIENCE, Promise, wait_for, withheld

__all__ = ["hosts"]
RACES = int(os.environ.get("SWARM_DEPLOY_RACES", "3"))
_SPAWN = multiprocessing.get_context("spawn")


def release(speed: str) -> Mapping[str, Bundle]:
    return bundles(**dict.fromkeys(HOSTS, f"speed: {speed}\n"))


def operate(hosts: Mapping[str, FakeHost], speed: str, start: Any, wait: float, answers: Any) -> None:
    """One operator, in a process of its own."""
    way = FolderTransport(hosts, {})
    start.wait(PATIENCE)
    time.sleep(wait)
    begin, before = time.monotonic(), withheld()
    found = deployed(deploy(release(speed), TARGETS, way, most_failed=0))
    seconds = time.monotonic() - begin - (withheld() - before)
    reported = {
        name: None if isinstance(one, Outcome) else (one.kind, str(one)) for name, one in found.items()
    }
    answers.put((speed, (reported, seconds)))


def begun(hosts: Mapping[str, FakeHost], speed: str, start: Any, wait: float, answers: Any) -> Any:
    process = _SPAWN.Process(target=operate, args=(hosts, speed, start, wait, answers))
    process.start()
    return process


def current(hosts: Mapping[str, FakeHost]) -> set[bytes]:
    return {host.read("opt/swarm/new/current/params/robot.yaml") for host in hosts.values()}


def test_of_two_operators_at_once_one_deploys(hosts: dict[str, FakeHost], promise: Promise) -> None:
    """SWARM_DEPLOY_RACES sets the number of races; `make races` runs 50."""
    deployed(deploy(release("0"), TARGETS, FolderTransport(hosts, {})))
    seed, stays, deployed_once, longest = random.Random(1), "0", 0, 0.0
    for number in range(RACES):
        start, answers = _SPAWN.Barrier(2), _SPAWN.SimpleQueue()
        speeds = f"{number}.1", f"{number}.2"
        running = [begun(hosts, speed, start, seed.uniform(0, 0.3), answers) for speed in speeds]
        answered = dict(answers.get() for _ in running)
        results_of = {speed: results for speed, (results, _) in answered.items()}
        for process in running:
            process.join(PATIENCE)
        won = [speed for speed, results in results_of.items() if not any(results.values())]
        assert len(current(hosts)) == 1, results_of  # one release, on all hosts
        (runs,) = current(hosts)
        expected = won or [stays]
        assert runs in [f"speed: {speed}\n".encode() for speed in expected]
        stays = runs.decode().split()[1]
        for speed in set(speeds) - set(won):
            longest = max(longest, answered[speed][1])
            lost = results_of[speed]
            assert {kind for kind, _ in lost.values()} <= {Kind.REFUSED, Kind.HELD}, lost
            texts = " ".join(text for _, text in lost.values())
            assert re.search(r"locked by \S+ \(\d+\)|another deploy has changed it", texts), texts
        deployed_once += bool(won)
    assert deployed_once > RACES // 2
    promise("of two operators at once, until one reads who deploys", longest, 2)


def record(host: FakeHost) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(host.read("opt/swarm/new/state/transaction.json"))
    return found


@pytest.mark.parametrize("amid", HOSTS)
def test_a_plan_made_amid_a_change_of_another_changes_no_host(
    hosts: dict[str, FakeHost], monkeypatch: pytest.MonkeyPatch, amid: str
) -> None:
    """The second look of the survey finds that change at work on one host, and done on the others."""
    deployed(deploy(release("0"), TARGETS, FolderTransport(hosts, {})))
    first_looks = {name: record(host)["txid"] for name, host in hosts.items()}
    held, start, answers = hosts[amid].prefix / "held", _SPAWN.Barrier(1), _SPAWN.SimpleQueue()
    others: list[Any] = []

    def changed(name: str, state: str) -> bool:
        now = record(hosts[name])
        return now["txid"] != first_looks[name] and now["state"] == state

    def other_begins() -> None:
        held.touch()
        others.append(begun(hosts, "1", start, 0, answers))
        states = {name: "applying" if name == amid else "applied" for name in HOSTS}
        wait_for(lambda: all(changed(name, state) for name, state in states.items()))

    def other_ends() -> None:
        held.unlink()
        others[0].join(PATIENCE)

    before, after = threading.Barrier(len(HOSTS), other_begins), threading.Barrier(len(HOSTS), other_ends)
    look = Deployment._observed_in_use

    def amid_the_change(self: Deployment, *arguments: Any) -> Any:
        before.wait(PATIENCE)
        found = look(self, *arguments)
        after.wait(PATIENCE)
        return found

    monkeypatch.setattr(Deployment, "_observed_in_use", amid_the_change)
    results = deployed(deploy(release("2"), TARGETS, FolderTransport(hosts, {}), most_failed=0))

    assert not any(answers.get()[1][0].values())
    assert current(hosts) == {b"speed: 1\n"}, results
    kinds = {name: one.kind for name, one in results.items() if isinstance(one, HostError)}
    assert kinds == {name: Kind.REFUSED if name == amid else Kind.HELD for name in HOSTS}
    for one in results.values():
        assert re.search(rf"another deploy has changed it .*, by \S+ \({others[0].pid}\)", str(one))


def test_a_host_that_waits_for_another_operator_holds_all_back(
    hosts: dict[str, FakeHost],
) -> None:
    deployed(deploy(release("0"), TARGETS, FolderTransport(hosts, {})))
    theirs = {"previous": release("0")["k3"].digest, "confirm_within": 3000.0, "who": "ann@desk (7)"}
    request = message_for(release("1")["k3"], start=[], restart=["new.robot.service"], **theirs)
    assert not hosts["k3"].ask(*request).error

    two = deploy(release("2"), TARGETS, FolderTransport(hosts, {}), most_failed=None, optional=tuple(HOSTS))
    results = deployed(two)

    assert {name: one.kind for name, one in results.items() if isinstance(one, HostError)} == {
        "leader": Kind.HELD, "k3": Kind.REFUSED, "epuck": Kind.HELD
    }  # fmt: skip
    why = "nothing was changed, since k3 is locked by ann@desk (7), whose deploy waits for its confirmation"
    assert str(results["leader"]).startswith(why)
    assert current(hosts) == {b"speed: 0\n", b"speed: 1\n"}


def test_the_lease_of_a_killed_run_is_taken_over_at_once(hosts: dict[str, FakeHost]) -> None:
    deployed(deploy(release("0"), TARGETS, FolderTransport(hosts, {})))
    state = hosts["leader"].prefix / "opt/swarm/new/state/lease.json"
    start, answers = _SPAWN.Barrier(1), _SPAWN.SimpleQueue()
    process = begun(hosts, "1", start, 0, answers)
    wait_for(lambda: '"run": ""' not in state.read_text(), interval=0.002)
    os.kill(process.pid, signal.SIGKILL)
    process.join(PATIENCE)

    found = deployed(deploy(release("2"), TARGETS, FolderTransport(hosts, {})))
    again = deployed(deploy(release("2"), TARGETS, FolderTransport(hosts, {})))

    assert all(isinstance(one, Outcome | HostError) for one in found.values())
    assert all(isinstance(one, Outcome) for one in again.values()), again
    assert current(hosts) == {b"speed: 2\n"}
