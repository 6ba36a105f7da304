"""Several operators deploy to the same hosts at once: one changes all of them, or none does."""

from __future__ import annotations

import multiprocessing
import os
import random
import re
import signal
import time
from collections.abc import Mapping
from typing import Any

from swarmctl.deploy.outcome import Outcome
from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.bundle import Bundle
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import HOSTS, TARGETS, FolderTransport, bundles, deployed, hosts
from tests.onboard.agent.fakehost import FakeHost
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
            assert re.search(r"locked by \S+ \(\d+\)|another deploy|stale plan", texts), texts
        deployed_once += bool(won)
    assert deployed_once > RACES // 2
    promise("of two operators at once, until one reads who deploys", longest, 2)


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
