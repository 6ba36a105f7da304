"""Faults in a table: which findings each gives, which of them is the cause, whether the swarm is healthy."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.health.checks import State
from swarmctl.health.health_findings import Diagnosis
from swarmctl.health.observations import Report, SenderSeen
from swarmctl.health.root_cause import diagnose
from swarmctl.remote.transport import HostError, Kind
from tests.health.swarm_values import (
    EPUCK_PI,
    HOSTS,
    K3_PI,
    LAPTOP,
    MASTER,
    RFCOMM,
    UNIT,
    WLAN,
    Spoil,
    all_well,
    both,
    changed,
    graph,
    no_serial_port,
    nothing_deployed,
    with_device,
    with_master,
    with_node,
    with_optional,
    with_senders,
    with_topic,
    with_unit,
)

AWAY = HostError(Kind.UNREACHABLE, "connect timed out", "is it on?")
LOST = HostError(Kind.LOST, "the connection died")
WRONG_KEY = HostError(Kind.HOST_KEY, "the key is not the pinned one")


def spoilt(host: str, spoil: Spoil) -> dict[str, Any]:
    answers = all_well()
    return {**answers, host: spoil(answers[host])}


def shape(found: Diagnosis) -> dict[str, tuple[str, list[str]]]:
    """Every cause that is not ok: its state, and the keys of its symptoms."""
    return {
        cause.key: (cause.state.value, [one.key for one in symptoms]) for cause, symptoms in found.explained()
    }


def test_all_well_is_healthy_and_silent() -> None:
    found = diagnose(graph(), all_well())
    assert found.healthy
    assert shape(found) == {}
    assert all(one.state is State.OK for one in found.findings)


@dataclass(frozen=True)
class Fault:
    """A fault on one host, and what is made of it."""

    host: str
    spoil: Spoil
    causes: Mapping[str, tuple[str, list[str]]]
    healthy: bool = False
    message: str = ""


K3_TOPICS = [f"topic /k3/{sensor} of k3" for sensor in ("odom", "proximity", "ground", "battery")]
UNIT_K3 = f"unit {UNIT['k3']} on {K3_PI}"
UNIT_WLAN = f"unit {WLAN} on {K3_PI}"
DEAD = {"active": "inactive", "sub": "dead", "pid": 0}

FAULTS = {
    "nothing deployed": Fault(
        K3_PI,
        nothing_deployed,
        {
            f"release {K3_PI}": (
                "bad",
                [UNIT_WLAN, f"unit swarm-newswarm.target on {K3_PI}", "device k3", UNIT_K3, "driver k3"],
            )
        },
        message="nothing is deployed",
    ),
    "old release that works": Fault(
        K3_PI,
        changed(release="0" * 16),
        {f"release {K3_PI}": ("warning", [])},
        healthy=True,
        message=f"runs {'0' * 16}, the spec renders {'b' * 16}",
    ),
    "old release that publishes more slowly": Fault(
        K3_PI,
        both(changed(release="0" * 16), with_topic("k3", "/k3/odom", rate=5.0)),
        {f"release {K3_PI}": ("warning", ["topic /k3/odom of k3"])},
    ),
    "unplugged cable": Fault(
        K3_PI,
        no_serial_port("k3"),
        {"device k3": ("bad", ["report k3", *K3_TOPICS])},
        message="/dev/swarm/k3 does not exist",
    ),
    "unplugged cable under an old release": Fault(
        K3_PI,
        both(no_serial_port("k3"), changed(release="0" * 16)),
        {f"release {K3_PI}": ("warning", []), "device k3": ("bad", ["report k3", *K3_TOPICS])},
    ),
    "device that drivers may not open": Fault(
        K3_PI,
        with_device("k3", usable=False, group="root", mode=0o600),
        {"device k3": ("bad", [])},
        message="cannot be opened by drivers: group root, mode 0600",
    ),
    "a file where the device should be": Fault(
        K3_PI, with_device("k3", is_device=False), {"device k3": ("bad", [])}, message="not a serial device"
    ),
    "robot switched off": Fault(
        K3_PI,
        both(
            with_node("k3", report=Report(2, "no reply to D at 115200 baud")),
            with_topic("k3", "/k3/odom", count=0, rate=None),
        ),
        {"report k3": ("bad", ["topic /k3/odom of k3"])},
        message="no reply to D at 115200 baud",
    ),
    "driver that warns": Fault(
        K3_PI, with_node("k3", report=Report(1, "slow")), {"report k3": ("warning", [])}, healthy=True
    ),
    "slow topic": Fault(
        K3_PI,
        with_topic("k3", "/k3/odom", rate=3.1),
        {"topic /k3/odom of k3": ("bad", [])},
        message="measured 3.1 Hz of 10",
    ),
    "topic just fast enough": Fault(K3_PI, with_topic("k3", "/k3/odom", rate=7.0), {}, healthy=True),
    "topic without messages": Fault(
        K3_PI,
        with_topic("k3", "/k3/odom", count=0, rate=None),
        {"topic /k3/odom of k3": ("bad", [])},
        message="no message in 2 s, 10 Hz expected",
    ),
    "topic with one message": Fault(
        K3_PI,
        with_topic("k3", "/k3/odom", count=1, rate=None),
        {"topic /k3/odom of k3": ("bad", [])},
        message="one message in 2 s, 10 Hz expected",
    ),
    "window too short for a topic": Fault(
        K3_PI,
        with_topic("k3", "/diagnostics", count=0, rate=None, seconds=1.0),
        {"topic /diagnostics of k3": ("skipped", [])},
        healthy=True,
    ),
    "topic that cannot be received": Fault(
        K3_PI,
        with_topic("k3", "/k3/odom", count=0, error="it sends more than 32 MB in 2 s"),
        {"topic /k3/odom of k3": ("bad", [])},
        message="cannot be received: it sends",
    ),
    "crash loop": Fault(
        K3_PI,
        both(
            with_unit(UNIT["k3"], active="activating", sub="auto-restart", restarts=7, result="exit-code"),
            with_node("k3", registered=False, alive=None),
        ),
        {UNIT_K3: ("bad", ["driver k3"])},
        message="crash loop: restarted 7 times, last result exit-code",
    ),
    "restarted while being looked at": Fault(
        K3_PI,
        with_unit(UNIT["k3"], restarts=1, restarted=1),
        {UNIT_K3: ("bad", [])},
        message="crash loop: restarted 1 time,",
    ),
    "restarted often before": Fault(
        K3_PI, with_unit(UNIT["k3"], restarts=3), {UNIT_K3: ("warning", [])}, healthy=True
    ),
    "failed driver with a stale registration": Fault(
        K3_PI,
        both(
            with_unit(UNIT["k3"], active="failed", sub="failed", result="watchdog", pid=0),
            with_node("k3", alive=False, error="connection refused"),
        ),
        {UNIT_K3: ("bad", ["driver k3"])},
        message="failed: watchdog",
    ),
    "stopped driver": Fault(
        K3_PI,
        both(with_unit(UNIT["k3"], **DEAD), with_node("k3", registered=False, alive=None)),
        {UNIT_K3: ("bad", ["driver k3"])},
        message="does not run (inactive)",
    ),
    "driver that is starting": Fault(
        K3_PI,
        with_unit(UNIT["k3"], active="activating", sub="start"),
        {UNIT_K3: ("warning", [])},
        healthy=True,
    ),
    "hanging driver": Fault(
        K3_PI,
        with_node("k3", alive=False, error="no answer within 2 s"),
        {"driver k3": ("bad", [])},
        message="is registered and its unit runs, but it does not answer",
    ),
    "driver that a new master does not know": Fault(
        K3_PI,
        with_node("k3", registered=False, alive=None),
        {"driver k3": ("bad", [])},
        message="although its unit runs; the master may have been restarted",
    ),
    "driver that advertises localhost": Fault(
        K3_PI,
        with_node("k3", uri="http://localhost:40001/"),
        {"driver k3": ("bad", [])},
        message="advertises localhost instead of 192.168.77.11",
    ),
    "deaf driver": Fault(
        K3_PI,
        with_node("k3", subscribes={}),
        {"driver k3": ("bad", [])},
        message="does not subscribe to /k3/cmd_vel",
    ),
    "second driver of the same name": Fault(
        K3_PI,
        with_node("k3", pid=43),
        {"driver k3": ("warning", [])},
        healthy=True,
        message="a second driver",
    ),
    "driver that publishes nothing": Fault(
        K3_PI,
        with_node("k3", publishes={}),
        dict.fromkeys((*K3_TOPICS, "topic /diagnostics of k3"), ("bad", [])),
        message="is not published",
    ),
    "no Bluetooth adapter, but a device": Fault(
        EPUCK_PI,
        with_unit(RFCOMM, active="inactive", sub="dead", skipped=True),
        {f"unit {RFCOMM} on {EPUCK_PI}": ("skipped", [])},
        healthy=True,
    ),
    "no Bluetooth adapter and no device": Fault(
        EPUCK_PI,
        both(
            with_unit(RFCOMM, active="inactive", sub="dead", skipped=True), with_device("epuck", exists=False)
        ),
        {f"unit {RFCOMM} on {EPUCK_PI}": ("skipped", ["device epuck"])},
    ),
    "network between a host and its hub": Fault(
        K3_PI,
        both(with_master(reachable=False, error="no answer within 2 s"), changed(nodes={})),
        {f"master {K3_PI}": ("bad", ["driver k3"])},
        message="does not answer: no answer within 2 s",
    ),
    "another master at the hub's address": Fault(
        K3_PI, with_master(run_id="run-2"), {f"master {K3_PI}": ("bad", [])}, message="another master than"
    ),
    "commands of the leader": Fault(LAPTOP, with_senders("k3", rostopic_1="192.168.77.10"), {}, healthy=True),
    "commands of an unauthorised node": Fault(
        LAPTOP,
        with_senders("k3", rostopic_77="192.168.77.12"),
        {"authority k3": ("warning", [])},
        healthy=True,
        message="unauthorised publisher /rostopic_77 on 192.168.77.12 on /k3/cmd_vel; rejected by the driver",
    ),
    "commands of many unauthorised nodes": Fault(
        LAPTOP,
        with_senders("k3", **{f"rostopic_{number}": "192.168.77.12" for number in range(5)}),
        {"authority k3": ("warning", [])},
        healthy=True,
        message="/rostopic_2 on 192.168.77.12, 2 more on /k3/cmd_vel; rejected by the driver",
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
    "orders of another type": Fault(
        LAPTOP,
        both(
            with_senders("k3", teleop="192.168.77.10"),
            changed(senders={"/teleop": SenderSeen("192.168.77.10", {"/k3/cmd_vel": "a_msgs/TwistStamped"})}),
        ),
        {"orders k3": ("bad", [])},
        message="/teleop on 192.168.77.10 publishes /k3/cmd_vel as a_msgs/TwistStamped instead of",
    ),
    "clock astray": Fault(
        K3_PI,
        changed(clock_ahead=-61.0),
        {f"clock {K3_PI}": ("warning", [])},
        healthy=True,
        message="61.1 s behind",
    ),
    "systemd that does not answer": Fault(
        K3_PI,
        changed(units={}, troubles={"units": "systemctl did not end within 20 s"}),
        {f"probe {K3_PI} units": ("unknown", [UNIT_WLAN, f"unit swarm-newswarm.target on {K3_PI}", UNIT_K3])},
    ),
    "graph that took too long": Fault(
        K3_PI,
        changed(nodes={}, troubles={"ros": "master and nodes took too long to answer"}),
        {f"probe {K3_PI} ros": ("unknown", ["driver k3"])},
    ),
    "empty answer": Fault(
        K3_PI,
        changed(release="b" * 16, units={}, nodes={}, devices={}, master=None),
        {
            UNIT_WLAN: ("unknown", []),
            f"unit swarm-newswarm.target on {K3_PI}": ("unknown", []),
            f"master {K3_PI}": ("unknown", ["driver k3"]),
            "device k3": ("unknown", []),
            UNIT_K3: ("unknown", []),
        },
    ),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_reported_with_its_symptoms(fault: Fault) -> None:
    found = diagnose(graph(), spoilt(fault.host, fault.spoil))
    assert shape(found) == fault.causes
    assert found.healthy is fault.healthy
    assert any(fault.message in cause.message for cause, _ in found.explained()) or not fault.causes


def test_what_a_driver_refuses_explains_its_warning() -> None:
    answers = spoilt(LAPTOP, with_senders("k3", rostopic_77="192.168.77.12"))
    warned = with_node("k3", report=Report(1, "standing still; refuses /rostopic_77"))
    found = diagnose(graph(), {**answers, K3_PI: warned(answers[K3_PI])})
    assert shape(found) == {"authority k3": ("warning", ["report k3"])}


def test_a_dead_master_explains_every_host() -> None:
    dead = both(with_master(reachable=False, error="connection refused"), changed(nodes={}))
    answers = {name: dead(answer) for name, answer in all_well().items()}
    answers[LAPTOP] = with_unit(MASTER, active="failed", sub="failed", result="exit-code")(answers[LAPTOP])
    found = diagnose(graph(), answers)
    symptoms = [
        *(f"master {name}" for name in HOSTS),
        *(f"driver {robot}" for robot in ("koala", "k3", "epuck")),
    ]
    assert shape(found) == {f"unit {MASTER} on {LAPTOP}": ("bad", symptoms)}


def test_a_dead_host_costs_only_its_row() -> None:
    found = diagnose(graph(), {**all_well(), K3_PI: AWAY})
    assert shape(found) == {f"host {K3_PI}": ("bad", ["robot k3"])}
    assert {one.state for one in found.findings if one.robot == "k3"} == {State.UNKNOWN}
    assert found.only_unreachable


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


@pytest.mark.parametrize(
    ("error", "key", "only_unreachable"),
    [(AWAY, "host", True), (LOST, "host", True), (WRONG_KEY, "host-key", False)]
    + [
        (HostError(kind, "no"), kind.value, False)
        for kind in (Kind.AUTH, Kind.PRIVILEGE, Kind.PROTOCOL, Kind.FAILED)
    ],
)
def test_a_host_that_cannot_be_asked_says_why(error: HostError, key: str, only_unreachable: bool) -> None:
    found = diagnose(graph(), {**all_well(), K3_PI: error})
    assert shape(found) == {f"{key} {K3_PI}": ("bad", ["robot k3"])}
    assert not found.healthy
    assert found.only_unreachable is only_unreachable


def test_another_fault_beside_a_dead_host_is_unhealthy() -> None:
    found = diagnose(graph(), {**spoilt(EPUCK_PI, with_device("epuck", exists=False)), K3_PI: AWAY})
    assert not found.only_unreachable


@pytest.mark.parametrize("name", [K3_PI, "k3"])
def test_an_optional_robot_may_be_absent(name: str) -> None:
    found = diagnose(with_optional(name), spoilt(K3_PI, no_serial_port("k3")))
    assert found.healthy
    assert shape(found)["device k3"][0] == "warning"


def test_an_optional_host_may_be_absent() -> None:
    found = diagnose(with_optional(K3_PI), {**all_well(), K3_PI: AWAY})
    assert found.healthy
    assert shape(found) == {f"host {K3_PI}": ("warning", ["robot k3"])}


def test_a_part_of_the_swarm_can_be_looked_at_alone() -> None:
    alone = graph((K3_PI,))
    assert diagnose(alone, all_well(alone)).healthy


def test_a_host_that_was_not_asked_is_unknown() -> None:
    found = diagnose(graph(), {name: one for name, one in all_well().items() if name != K3_PI})
    assert shape(found) == {f"asked {K3_PI}": ("unknown", ["robot k3"])}
    assert not found.healthy
    assert not found.only_unreachable


_SPOILS = st.sampled_from([(fault.host, fault.spoil) for fault in FAULTS.values()])


@given(st.lists(_SPOILS, max_size=4), st.sets(st.sampled_from(HOSTS)))
def test_every_cause_comes_before_its_symptoms(spoils: list[tuple[str, Spoil]], away: set[str]) -> None:
    answers: dict[str, Any] = all_well()
    for host, spoil in spoils:
        with suppress(KeyError, TypeError):  # an earlier fault has taken away what this one spoils
            answers[host] = spoil(answers[host])
    found = diagnose(graph(), {**answers, **dict.fromkeys(away, AWAY)})
    seen: dict[str, Any] = {}
    for one in found.findings:
        assert one.cause is None or seen[one.cause].cause is None
        assert one.cause is None or one.state is not State.OK
        seen[one.key] = one
    assert len(seen) == len(found.findings)
    bad = {one.key for one in found.findings if one.state is State.BAD}
    assert bad <= {one.key for cause, symptoms in found.explained() for one in (cause, *symptoms)}


def test_a_rate_is_judged_by_what_the_robot_is_set_to() -> None:
    robot = graph((K3_PI,)).robots[0]
    twice = replace(robot, topics=tuple(replace(topic, rate=2 * topic.rate) for topic in robot.topics))
    hosts = (replace(graph((K3_PI,)).hosts[0], robots=(twice,)),)
    found = diagnose(replace(graph(), hosts=hosts), all_well())
    assert any(one.message == "measured 10.0 Hz of 20" for one in found.findings)
