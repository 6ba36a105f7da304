"""Faults of robots: their devices, what their drivers report, and the topics that they publish."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.agent.observations import Report

from swarmctl.health.diagnosis import diagnose
from tests.health.faults import K3_TOPICS, Fault, check, shape, spoilt
from tests.health.swarm_values import (
    EPUCK_PI,
    K3_PI,
    NO_ADAPTER,
    RFCOMM,
    all_well,
    both,
    changed,
    graph,
    no_serial_port,
    with_device,
    with_node,
    with_optional,
    with_topic,
    with_unit,
)

FAULTS = {
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
    "parameters that the master has lost": Fault(
        K3_PI,
        with_node("k3", parameters=("port is not set", "limits/linear is 9 instead of 0.298")),
        {"parameters k3": ("bad", [])},
        message="of /k3/driver: port is not set, limits/linear is 9 instead of 0.298",
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
    "no Bluetooth adapter, but a device": Fault(
        EPUCK_PI,
        with_unit(RFCOMM, **NO_ADAPTER),
        {f"unit {RFCOMM} on {EPUCK_PI}": ("skipped", [])},
        healthy=True,
        message="is skipped: epuck-pi has no Bluetooth adapter hci0",
    ),
    "no Bluetooth adapter and no device": Fault(
        EPUCK_PI,
        both(with_unit(RFCOMM, **NO_ADAPTER), with_device("epuck", exists=False)),
        {f"unit {RFCOMM} on {EPUCK_PI}": ("skipped", ["device epuck"])},
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
    "driver that publishes nothing": Fault(
        K3_PI,
        with_node("k3", publishes={}),
        dict.fromkeys((*K3_TOPICS, "topic /diagnostics of k3"), ("bad", [])),
        message="is not published",
    ),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_reported_with_its_symptoms(fault: Fault) -> None:
    check(fault)


@pytest.mark.parametrize("name", [K3_PI, "k3"])
def test_an_optional_robot_may_be_absent(name: str) -> None:
    found = diagnose(with_optional(name), spoilt(K3_PI, no_serial_port("k3")))
    assert found.healthy
    assert shape(found)["device k3"][0] == "warning"


def test_a_rate_is_judged_by_what_the_robot_is_set_to() -> None:
    robot = graph((K3_PI,)).robots[0]
    twice = replace(robot, topics=tuple(replace(topic, rate=2 * topic.rate) for topic in robot.topics))
    hosts = (replace(graph((K3_PI,)).hosts[0], robots=(twice,)),)
    found = diagnose(replace(graph(), hosts=hosts), all_well())
    assert any(one.message == "measured 10.0 Hz of 20" for one in found.findings)
