"""Nodes that publish what only a driver should, and registered ones that do not answer."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.agent.observations import SenderSeen

from swarmctl.health.checks.publisher import publishers_of
from tests.health.faults import Fault, check
from tests.health.swarm_values import LAPTOP, changed, graph

INTRUDER = {"/intruder": SenderSeen("10.0.0.9", {"/k3/odom": "nav_msgs/Odometry"})}
SILENT = {"/teleop": SenderSeen("", {}, "connection refused")}
FAULTS = {
    "second publisher of a robot's topic": Fault(
        LAPTOP,
        changed(others={"/k3/odom": ("/intruder",)}, senders=INTRUDER),
        {"publisher /k3/odom": ("bad", [])},
        message="/intruder on 10.0.0.9 publishes it as well as /k3/driver: its subscribers receive both",
    ),
    "silent publisher of a robot's topic": Fault(
        LAPTOP,
        changed(others={"/k3/odom": ("/teleop",)}, senders=SILENT),
        {"publisher /k3/odom": ("warning", [])},
        healthy=True,
        message="/teleop is registered as its publisher, and does not answer: connection refused",
    ),
    "silent publisher of commands": Fault(
        LAPTOP,
        lambda answer: answer._replace(
            commanders={**answer.commanders, "/k3/cmd_vel": ("/teleop",)}, senders=SILENT
        ),
        {"publisher /k3/cmd_vel": ("warning", [])},
        healthy=True,
        message="does not answer: connection refused",
    ),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_reported(fault: Fault) -> None:
    check(fault)


def test_a_hub_looks_for_publishers_of_its_robots_own_topics() -> None:
    hub = next(host for host in graph().hosts if host.is_hub)
    wanted = publishers_of(graph(), hub)
    assert wanted["/k3/odom"] == ["/k3/driver"]
    assert not [topic for topic in wanted if topic.startswith(("/tf", "/diagnostics"))]


def test_what_a_program_of_any_host_declares_is_left_to_it() -> None:
    declared = replace(graph((LAPTOP, "k3-pi")), program_topics=("/k3/odom",))
    hub = next(host for host in declared.hosts if host.is_hub)
    assert "/k3/odom" not in publishers_of(declared, hub)
    assert publishers_of(declared, hub)["/k3/battery"] == ["/k3/driver"]
