"""Faults of masters and of who commands: no master, another one, unauthorised senders."""

from __future__ import annotations

import pytest
from swarm_onboard.agent.observations import Report, SenderSeen

from swarmctl.health.diagnosis import diagnose
from tests.health.faults import AWAY, Fault, check, shape, spoilt
from tests.health.swarm_values import (
    EPUCK_PI,
    HOSTS,
    K3_PI,
    LAPTOP,
    MASTER,
    UNIT,
    all_well,
    both,
    changed,
    graph,
    with_master,
    with_node,
    with_senders,
    with_unit,
)

ROBOTS = ("koala", "k3", "epuck")
FAULTS = {
    "network between a host and its hub": Fault(
        K3_PI,
        both(with_master(reachable=False, error="no answer within 2 s"), changed(nodes={})),
        {f"master {K3_PI}": ("bad", ["driver k3"])},
        message="does not answer: no answer within 2 s",
    ),
    "another master at the hub's address": Fault(
        K3_PI, with_master(run_id="run-2"), {f"master {K3_PI}": ("bad", [])}, message="another master than"
    ),
    "parameters that the master has lost": Fault(
        LAPTOP,
        both(with_master(run_id=""), with_node("koala", parameters=("robot is not set",))),
        {f"master {LAPTOP}": ("bad", ["parameters koala"])},
        message="http://192.168.77.10:11311 answers, and has lost its parameters: /run_id is not set",
    ),
    "commands of the leader": Fault(LAPTOP, with_senders("k3", rostopic_1="192.168.77.10"), {}, healthy=True),
    "commands of an unauthorised node": Fault(
        LAPTOP,
        with_senders("k3", rostopic_77="192.168.77.12"),
        {"authority k3": ("warning", [])},
        healthy=True,
        message="unauthorised publisher /rostopic_77 on 192.168.77.12 on /k3/cmd_vel; the driver has",
    ),
    "commands of many unauthorised nodes": Fault(
        LAPTOP,
        with_senders("k3", **{f"rostopic_{number}": "192.168.77.12" for number in range(5)}),
        {"authority k3": ("warning", [])},
        healthy=True,
        message="/rostopic_2 on 192.168.77.12, 2 more on /k3/cmd_vel; the driver has received no command",
    ),
    "commands of an unauthorised node that is gone": Fault(
        LAPTOP,
        both(
            with_senders("k3", rostopic_77="192.168.77.12"),
            changed(senders={"/rostopic_77": SenderSeen("192.168.77.12", {})}),
        ),
        {},
        healthy=True,
    ),
    "commands of another type": Fault(
        LAPTOP,
        both(
            with_senders("k3", teleop="192.168.77.10"),
            changed(senders={"/teleop": SenderSeen("192.168.77.10", {"/k3/cmd_vel": "a_msgs/TwistStamped"})}),
        ),
        {"command type k3": ("bad", [])},
        message="/teleop on 192.168.77.10 publishes /k3/cmd_vel as a_msgs/TwistStamped instead of",
    ),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_reported_with_its_symptoms(fault: Fault) -> None:
    check(fault)


def test_drivers_that_join_a_new_master_are_symptoms_of_its_restart() -> None:
    answers = all_well()
    new = with_unit(MASTER, restarts=1, recent=1, running=2.0, exit="signal")
    joins = with_unit(UNIT["k3"], restarts=1, restarted=1, exit="exit code 91")
    found = diagnose(graph(), {**answers, LAPTOP: new(answers[LAPTOP]), K3_PI: joins(answers[K3_PI])})
    assert shape(found) == {
        f"unit {MASTER} on {LAPTOP}": ("warning", [f"unit {UNIT['k3']} on {K3_PI}"]),
    }


def test_a_driver_joins_a_new_master_while_its_hub_is_not_looked_at() -> None:
    """As with `--limit`."""
    joins = with_unit(UNIT["k3"], restarts=1, restarted=1, exit="exit code 91")
    found = diagnose(graph((K3_PI,)), {K3_PI: joins(all_well()[K3_PI])})
    assert shape(found) == {f"unit {UNIT['k3']} on {K3_PI}": ("warning", [])}


def test_a_dead_master_explains_every_host() -> None:
    dead = both(with_master(reachable=False, error="connection refused"), changed(nodes={}))
    answers = {name: dead(answer) for name, answer in all_well().items()}
    answers[LAPTOP] = with_unit(MASTER, active="failed", sub="failed", result="exit-code")(answers[LAPTOP])
    found = diagnose(graph(), answers)
    symptoms = [
        *(f"master {name}" for name in HOSTS),
        *(f"driver {robot}" for robot in ROBOTS),
    ]
    assert shape(found) == {f"unit {MASTER} on {LAPTOP}": ("bad", symptoms)}


@pytest.mark.parametrize("moment", ["start-pre", "auto-restart"])
def test_a_foreign_master_on_the_port_is_not_taken_for_the_own(moment: str) -> None:
    """It answers every host, and knows none of the nodes."""
    answers = {
        name: both(
            *(with_node(robot, registered=False) for robot in ROBOTS if f"/{robot}/driver" in answer.nodes)
        )(answer)
        for name, answer in all_well().items()
    }
    log = "port 11311 is in use by process 812 (rosmaster)"
    waits = with_unit(MASTER, active="activating", sub=moment, restarts=1, log=log)
    answers[LAPTOP] = waits(answers[LAPTOP])
    found = diagnose(graph(), answers)
    members = [f"master {name}" for name in HOSTS if name != LAPTOP]
    symptoms = [f"unit {MASTER} on {LAPTOP}", *members, *(f"driver {robot}" for robot in ROBOTS)]
    assert shape(found) == {f"master {LAPTOP}": ("bad", symptoms)}
    (cause,) = (one for one, _ in found.explained())
    assert cause.message.endswith(f"its log ends with: {log}")


def test_a_dead_hub_explains_the_masters_absence() -> None:
    gone = both(with_master(reachable=False, error="no route to host"), changed(nodes={}))
    answers = {name: gone(answer) for name, answer in all_well().items()}
    found = diagnose(graph(), {**answers, LAPTOP: AWAY})
    members = [f"master {K3_PI}", f"master {EPUCK_PI}"]
    assert set(shape(found)) == {f"host {LAPTOP}"}
    assert set(shape(found)[f"host {LAPTOP}"][1]) == {*members, "robot koala", "driver k3", "driver epuck"}
    assert not found.only_unreachable


def test_a_hub_without_ssh_leaves_the_others_healthy() -> None:
    found = diagnose(graph(), {**all_well(), LAPTOP: AWAY})
    assert shape(found) == {f"host {LAPTOP}": ("bad", ["robot koala"])}


def test_what_a_driver_refuses_explains_its_warning() -> None:
    answers = spoilt(LAPTOP, with_senders("k3", rostopic_77="192.168.77.12"))
    warned = with_node("k3", report=Report(1, "standing still; refuses /rostopic_77"))
    found = diagnose(graph(), {**answers, K3_PI: warned(answers[K3_PI])})
    assert shape(found) == {"authority k3": ("warning", ["report k3"])}
