"""Faults of hosts: an absent one, another release, a probe that finds nothing, a wrong clock."""

from __future__ import annotations

import pytest

from swarmctl.health.checks import State
from swarmctl.health.diagnosis import diagnose
from swarmctl.remote.transport import HostError, Kind
from tests.health.faults import AWAY, UNIT_K3, UNIT_WLAN, Fault, check, shape, spoilt
from tests.health.swarm_values import (
    EPUCK_PI,
    K3_PI,
    all_well,
    both,
    changed,
    graph,
    nothing_deployed,
    with_device,
    with_optional,
    with_topic,
)

LOST = HostError(Kind.LOST, "the connection died")
WRONG_KEY = HostError(Kind.HOST_KEY, "the key is not the pinned one")

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
    "clock astray": Fault(
        K3_PI,
        changed(clock_ahead=-61.0),
        {f"clock {K3_PI}": ("warning", [])},
        healthy=True,
        message="61.1 s behind",
    ),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_reported_with_its_symptoms(fault: Fault) -> None:
    check(fault)


def test_a_dead_host_costs_only_its_row() -> None:
    found = diagnose(graph(), {**all_well(), K3_PI: AWAY})
    assert shape(found) == {f"host {K3_PI}": ("bad", ["robot k3"])}
    assert {one.state for one in found.findings if one.robot == "k3"} == {State.UNKNOWN}
    assert found.only_unreachable


@pytest.mark.parametrize(
    ("error", "key", "only_unreachable"),
    [(AWAY, "host", True), (LOST, "host", True), (WRONG_KEY, "host-key", False)]
    + [
        (HostError(kind, "no"), kind.value, False)
        for kind in (Kind.AUTH, Kind.PRIVILEGE, Kind.PROTOCOL, Kind.FAILED)
    ],
)
def test_an_unreachable_host_has_its_reason(error: HostError, key: str, only_unreachable: bool) -> None:
    found = diagnose(graph(), {**all_well(), K3_PI: error})
    assert shape(found) == {f"{key} {K3_PI}": ("bad", ["robot k3"])}
    assert not found.healthy
    assert found.only_unreachable is only_unreachable


def test_another_fault_beside_a_dead_host_is_unhealthy() -> None:
    found = diagnose(graph(), {**spoilt(EPUCK_PI, with_device("epuck", exists=False)), K3_PI: AWAY})
    assert not found.only_unreachable


def test_an_optional_host_may_be_absent() -> None:
    found = diagnose(with_optional(K3_PI), {**all_well(), K3_PI: AWAY})
    assert found.healthy
    assert shape(found) == {f"host {K3_PI}": ("warning", ["robot k3"])}


def test_a_host_that_was_not_probed_is_unknown() -> None:
    found = diagnose(graph(), {name: one for name, one in all_well().items() if name != K3_PI})
    assert shape(found) == {f"probed {K3_PI}": ("unknown", ["robot k3"])}
    assert not found.healthy
    assert not found.only_unreachable


def test_a_part_of_the_swarm_can_be_looked_at_alone() -> None:
    alone = graph((K3_PI,))
    assert diagnose(alone, all_well(alone)).healthy
