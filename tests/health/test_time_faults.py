"""Faults of simulated time: a master that differs from the spec, a clock that stands or is absent."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.agent.observations import NodeSeen, SimulatedTimeSeen
from swarm_onboard.agent.systemd import UnitState

from swarmctl.health.collect import request
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedProgram
from swarmctl.health.root_cause import Diagnosis
from tests.health.faults import shape
from tests.health.swarm_values import K3_PI, LAPTOP, MASTER, RUNNING, all_well, graph, with_topic

UNIT = "swarm-newswarm.sim.service"
TYPES = {"/clock": "rosgraph_msgs/Clock"}
SIM = ExpectedProgram("sim", LAPTOP, False, UNIT, "/sim", (), "", tuple(TYPES.items()), ())
NODE = NodeSeen(True, True, "http://192.168.77.10:4001/", 42, "", TYPES, {}, {}, None)
MOVES = SimulatedTimeSeen(used=True, publishers=("/sim",), count=40, moved=1.95, seconds=2.0, now=1003.2)
REAL = SimulatedTimeSeen(used=False)
CHECK = f"simulated time {LAPTOP}"


def simulated() -> ExpectedGraph:
    """The example's graph with simulated time, whose clock is a program on the hub."""
    hosts = (replace(one, programs=(SIM,)) if one.name == LAPTOP else one for one in graph().hosts)
    return replace(graph(), hosts=tuple(hosts), simulated_time=True)


def seen(time: SimulatedTimeSeen | None, unit: UnitState = RUNNING) -> Diagnosis:
    answers, hub = all_well(), all_well()[LAPTOP]
    answers[LAPTOP] = answers[LAPTOP]._replace(
        units={**hub.units, UNIT: unit}, nodes={**hub.nodes, "/sim": NODE}, simulated_time=time
    )
    return diagnose(simulated(), answers)


def test_a_clock_that_moves_is_healthy() -> None:
    assert seen(MOVES).healthy


@pytest.mark.parametrize(
    ("time", "message", "repair"),
    [
        (REAL, "/use_sim_time is not true at http://192.168.77.10:11311", f"systemctl restart {MASTER}"),
        (MOVES._replace(publishers=()), "nothing publishes /clock", "is paused or has ended"),
        (
            MOVES._replace(publishers=("/bag", "/sim")),
            "/bag, /sim publish /clock: the time jumps",
            "stop all",
        ),
        (MOVES._replace(count=0, moved=None), "no message of /sim on /clock in 2 s", "is paused"),
        (MOVES._replace(moved=0.0), "stands at 1003.2 s: 40 messages in 2 s have the same time", "is paused"),
        (MOVES._replace(count=0, error="it is gone"), "/clock of /sim cannot be received: it is gone", ""),
    ],
)
def test_a_fault_of_the_time_is_named(time: SimulatedTimeSeen, message: str, repair: str) -> None:
    found = seen(time)
    assert shape(found) == {CHECK: ("bad", [])}
    (trouble,) = found.troubles
    assert message in trouble.message
    assert repair in trouble.hint


def test_one_message_of_the_clock_is_a_warning() -> None:
    found = seen(MOVES._replace(count=1, moved=None))
    assert shape(found) == {CHECK: ("warning", [])}
    assert found.healthy


def test_a_time_that_was_not_read_is_not_called_healthy() -> None:
    assert shape(seen(None)) == {CHECK: ("unknown", [])}


def test_a_clock_that_stands_is_below_the_program_that_stopped() -> None:
    stopped = RUNNING._replace(stopped=("77 (clock.py)",))
    assert shape(seen(MOVES._replace(count=0, moved=None), stopped)) == {"program sim": ("bad", [CHECK])}


def test_topics_that_stand_with_the_clock_are_below_it() -> None:
    answers = all_well()
    hub = answers[LAPTOP]
    answers[LAPTOP] = answers[LAPTOP]._replace(
        units={**hub.units, UNIT: RUNNING}, nodes={**hub.nodes, "/sim": NODE},
        simulated_time=MOVES._replace(moved=0.0),
    )  # fmt: skip
    answers[K3_PI] = with_topic("k3", "/k3/odom", count=0, rate=None)(answers[K3_PI])
    assert shape(diagnose(simulated(), answers)) == {CHECK: ("bad", ["topic /k3/odom of k3"])}


@pytest.mark.parametrize(("used", "healthy"), [(False, True), (True, False)])
def test_simulated_time_that_the_spec_has_not_is_unhealthy(used: bool, healthy: bool) -> None:
    answers = all_well()
    answers[LAPTOP] = answers[LAPTOP]._replace(simulated_time=SimulatedTimeSeen(used))
    found = diagnose(graph(), answers)
    assert found.healthy is healthy
    if used:
        (trouble,) = found.troubles
        assert "/use_sim_time is true at http://192.168.77.10:11311" in trouble.message
        assert "`ros: {use_sim_time: true}`" in trouble.hint


def test_only_hubs_listen_to_the_clock_and_only_if_time_is_simulated() -> None:
    def listens(shown: ExpectedGraph) -> list[float | None]:
        return [request(shown, host, 2.0).clock for host in shown.hosts]

    assert listens(graph()) == [0.0, None, None]
    assert listens(simulated()) == [2.0, None, None]
