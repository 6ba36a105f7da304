"""Deploying: what is printed before, done during and true after it."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from tests.e2e.conftest import FirstTime
from tests.e2e.lab_swarm import HOME, LEADER, LabSwarm, Note, namespace_of
from tests.e2e.ros_peers import roswtf, unregister_killed
from tests.e2e.sniffer import Talk, listening


def test_the_plan_says_2_before_the_deploy_and_0_after_it(first_time: FirstTime, note: Note) -> None:
    assert first_time.plan.status == 2, first_time.plan.err
    assert first_time.deploy.status == 0, first_time.deploy.out + first_time.deploy.err
    assert "3 of 3 hosts changed" in first_time.deploy.out
    assert first_time.plan_after.status == 0, first_time.plan_after.out
    assert first_time.plan_after.out.startswith("nothing to do\n")
    note("first deploy of 3 hosts", f"{first_time.deploy.seconds:.1f} s", "")


def test_the_deployed_swarm_is_healthy(swarm: LabSwarm) -> None:
    status = swarm.script("status")
    assert status.status == 0, status.out + status.err


def test_roswtf_finds_no_fault(swarm: LabSwarm) -> None:
    unregister_killed(swarm, LEADER)
    assert roswtf(swarm, f"{HOME}/current") == {}


def test_a_second_deploy_changes_nothing_over_one_connection_per_host(swarm: LabSwarm, note: Note) -> None:
    before = swarm.pids()
    deploys = [counted_deploy(swarm) for _ in range(2)]
    assert swarm.pids() == before
    for host, address in swarm.hosts.items():
        talks = [talk[address] for talk in deploys]
        assert [talk.connections for talk in talks] == [1, 1]
        payload = max(talk.payload for talk in talks)
        # Without any delay, messages that cross on their way look like round trips. That there are
        # at most 8 is promised where the way has a delay (tests/remote, over a proxy).
        seen = min(talk.round_trips for talk in talks)
        note(
            f"deploy with nothing to do: {host}",
            f"{payload} B, {seen} turns of talk ({talks[0].on_wire} B with TCP/IP)",
            "<= 8192 B",
        )
        assert payload <= 8192


@contextmanager
def keeping_connections(swarm: LabSwarm) -> Iterator[None]:
    """Verbs keep their connections in the block."""
    before, place = dict(swarm.environment), swarm.folder / "run"
    place.mkdir(mode=0o700)
    swarm.environment.update(SWARMCTL_NO_REUSE="0", XDG_RUNTIME_DIR=str(place))
    try:
        yield
    finally:
        swarm.environment.clear()
        swarm.environment.update(before)
        for file in place.glob("swarmctl/*.pid"):
            os.kill(int(file.read_text()), signal.SIGTERM)


def test_a_verb_uses_the_connections_of_the_one_before(swarm: LabSwarm) -> None:
    with keeping_connections(swarm):
        first = counted_deploy(swarm)
        with listening(namespace_of(swarm)) as begun:
            again = swarm.deploy()
    assert [talk.connections for talk in first.values()] == [1, 1, 1]
    assert "0 of 3 hosts changed" in again.out
    assert not begun


def counted_deploy(swarm: LabSwarm) -> Mapping[str, Talk]:
    """Deploy once more, which does nothing; returns what was sent to each address."""
    with listening(namespace_of(swarm)) as talks:
        run = swarm.deploy()
    assert run.status == 0
    assert "0 of 3 hosts changed" in run.out
    assert set(talks) == set(swarm.hosts.values())
    return talks
