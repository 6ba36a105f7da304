"""Restarts beyond the budget, stopped processes and equal node names are unhealthy, by their cause."""

from __future__ import annotations

from typing import Any

import pytest
from swarm_onboard.agent.observations import ConflictSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.checks import unit
from swarmctl.health.checks.unit import MOST_RESTARTS
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.verdict import State
from tests.health.faults import UNIT_K3, Fault, check, shape
from tests.health.swarm_values import (
    K3_PI,
    LAPTOP,
    MASTER,
    RUNNING,
    UNIT,
    Spoil,
    all_well,
    both,
    graph,
    with_master,
    with_node,
    with_unit,
)

KICKED = {"/k3/driver": ConflictSeen(4, 12.0)}
WAITS = {"active": "activating", "sub": "start-pre"}
BUDGET = "restarted 4 times within 10 min, last result"


def judged(**changes: Any) -> tuple[State, str]:
    found = unit.verdict("a.service", "pi", RUNNING._replace(**changes))
    return found.state, found.message


@pytest.mark.parametrize(
    ("changes", "state", "words"),
    [
        ({}, State.OK, "runs"),
        ({"restarts": 1, "recent": 1, "running": 31.0}, State.OK, "runs"),
        ({"restarts": 1, "recent": 1, "running": 3.2}, State.WARNING, "success; it has run for 3 s now"),
        ({"restarts": 1, "restarted": 1, "exit": "exit code 91"}, State.WARNING, "master is another one now"),
        ({"restarts": 1, "restarted": 1, "exit": "exit code 1"}, State.BAD, "ended and is started"),
        ({"restarts": MOST_RESTARTS, "recent": MOST_RESTARTS}, State.WARNING, "restarted 3 times since"),
        ({"restarts": 40, "recent": 0}, State.WARNING, "restarted 40 times since it was started"),
        ({"restarts": 40, "rejoined": 38}, State.OK, "runs"),
        ({"restarts": 4, "recent": 4}, State.BAD, f"{BUDGET} success"),
        ({"restarts": 4, "recent": 4, "exit": "exit code 1"}, State.BAD, f"{BUDGET} exit code 1"),
        ({"restarts": 4, "recent": 4, "running": 12.4}, State.BAD, "success; it has run for 12 s now"),
        ({"restarts": 4, "recent": 4, "running": 119.0}, State.BAD, "; it has run for 119 s now"),
        ({"restarts": 4, "recent": 4, "running": 599.0}, State.BAD, "; it has run for 9 min now"),
        ({"restarts": 4, "recent": 0, "running": 7200.0}, State.WARNING, "started; it has run for 2 h now"),
        (
            {"restarts": 4, "recent": 4, "active": "activating", "sub": "start"},
            State.BAD,
            "restarted 4 times,",
        ),
        ({**WAITS, "restarts": 1}, State.BAD, "ended and is started again, last result"),
        ({**WAITS, "restarts": 2}, State.BAD, "crash loop: restarted 2 times, last result"),
        ({**WAITS, "restarts": 1, "log": "port 1 is"}, State.BAD, "; its log ends with: port 1 is"),
        ({**WAITS, "starting": 2.0}, State.WARNING, "is starting"),
        ({**WAITS, "starting": 31.0, "log": "no x"}, State.BAD, "for 31 s; its log ends with: no x"),
        ({"active": "failed", "log": "no such file"}, State.BAD, "success; its log ends with: no such file"),
        ({"log": "of the last look"}, State.OK, "runs"),
        ({"restarts": 4, "recent": 4, "active": "inactive", "sub": "dead"}, State.BAD, BUDGET),
        ({"restarts": 4, "recent": 4, "result": "signal", "exit": "SIGKILL"}, State.BAD, "signal, SIGKILL"),
        ({"sub": "auto-restart", "restarts": 1, "exit": "exit code 75"}, State.BAD, "exit code 75"),
        ({"active": "failed", "result": "exit-code", "exit": "exit code 2"}, State.BAD, "exit code 2"),
        ({"stopped": ("77 (scan.py)",)}, State.BAD, "a signal has stopped its process 77 (scan.py)"),
        ({"stopped": ("7 (a)", "8 (b)")}, State.BAD, "a signal has stopped its processes 7 (a), 8 (b)"),
    ],
)
def test_a_unit_is_judged_by_its_recent_past(changes: dict[str, Any], state: State, words: str) -> None:
    found, message = judged(**changes)
    assert found is state
    assert words in message


def test_the_fix_of_a_stopped_process_is_a_command() -> None:
    found = unit.verdict("a.service", "pi", RUNNING._replace(stopped=("7 (a)", "8 (b)")))
    assert found.hint == "on pi: sudo kill -CONT 7 8"


STOPPED = both(
    with_unit(UNIT["k3"], stopped=("77 (serial_driver.py)",)),
    with_node("k3", alive=False, error="no answer within 2 s"),
)
STOPPED_MASTER = both(
    with_unit(MASTER, stopped=("9 (rosmaster)",)), with_master(reachable=False, error="no answer within 2 s")
)


def test_a_stopped_driver_explains_its_silence() -> None:
    check(Fault(K3_PI, STOPPED, {UNIT_K3: ("bad", ["driver k3"])}, message="77 (serial_driver.py)"))


def test_a_stopped_master_is_named_by_its_cause() -> None:
    answers = all_well()
    found = diagnose(graph(), {**answers, LAPTOP: STOPPED_MASTER(answers[LAPTOP])})
    assert shape(found)[f"unit {MASTER} on {LAPTOP}"] == ("bad", [f"master {LAPTOP}"])


def with_conflict(unit: str, **changes: Any) -> Spoil:
    def spoil(answer: Answer) -> Answer:
        spoilt = with_unit(unit, **changes)(answer) if changes else answer
        return spoilt._replace(conflicts={unit: KICKED})

    return spoil


def flapping(**changes: Any) -> dict[str, Any]:
    """Two units whose nodes end each other, at the one moment or the other."""
    answers = all_well()
    for host, robot in ((K3_PI, "k3"), (LAPTOP, "koala")):
        answers[host] = with_conflict(UNIT[robot], restarts=9, recent=9, **changes)(answers[host])
    return answers


def test_a_conflict_of_the_past_explains_nothing_of_today() -> None:
    answers = all_well()
    answers[K3_PI] = with_unit(UNIT["k3"], active="failed", sub="failed")(answers[K3_PI])
    for ago, explained in ((5.0, True), (369.0, False)):
        conflicts = {UNIT["k3"]: {"/k3/driver": ConflictSeen(3, ago)}}
        spoilt = {**answers, K3_PI: answers[K3_PI]._replace(conflicts=conflicts)}
        unit = next(one for one in diagnose(graph(), spoilt).findings if one.key == UNIT_K3)
        assert (unit.cause is not None) is explained


@pytest.mark.parametrize("moment", [{}, {"sub": "auto-restart"}, {"active": "activating"}, {"restarted": 1}])
def test_two_nodes_of_one_name_are_the_cause_at_every_look(moment: dict[str, Any]) -> None:
    found = diagnose(graph(), flapping(**moment))
    assert not found.healthy
    (cause,) = (one for one, _ in found.explained() if one.state is State.BAD)
    assert cause.message == (
        "two nodes are called /k3/driver, on hosts koala-laptop and k3-pi: "
        "each takes the name from the other, 8 times within 10 min"
    )
    units = [f"unit {UNIT['koala']} on {LAPTOP}", UNIT_K3]
    assert [one.key for one in found.findings if one.cause == cause.key and one.check == "unit"] == units


def test_a_node_that_runs_elsewhere_has_taken_the_name() -> None:
    answers = all_well()
    spoil = both(with_conflict(UNIT["k3"]), with_node("k3", uri="http://192.168.77.12:4001/"))
    answers[K3_PI] = spoil(answers[K3_PI])
    found = shape(diagnose(graph(), answers))
    assert found["node name /k3/driver"] == ("bad", ["driver k3"])


def test_a_second_node_that_is_gone_is_a_warning() -> None:
    answers = all_well()
    answers[K3_PI] = with_conflict(UNIT["k3"])(answers[K3_PI])
    found = diagnose(graph(), answers)
    assert found.healthy
    (cause,) = (one for one, _ in found.explained())
    assert cause.message == (
        f"a second node called /k3/driver has taken the name from that of {UNIT['k3']} on {K3_PI} "
        "4 times within 10 min, the last time 12 s ago"
    )


def test_two_units_of_one_host_may_have_the_name() -> None:
    answers = all_well()
    other = next(unit for unit in graph().hosts[1].release.units if unit != UNIT["k3"])
    answers[K3_PI] = answers[K3_PI]._replace(conflicts={UNIT["k3"]: KICKED, other: KICKED})
    found = diagnose(graph(), answers)
    assert not found.healthy
    assert "both on host k3-pi" in next(one.message for one, _ in found.explained())
