"""The order of a rollout: who is changed first, and with whom."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.agent.steps import Kind, Step

from swarmctl.analysis.impact import Impact
from swarmctl.plan.plan import HostPlan
from swarmctl.plan.waves import order, valid_size
from swarmctl.render.ros1.noetic import NOETIC

HUB = Impact("host", "desk", drivers=("a", "b"), masters=("m",), shared=True)
PARTS = (HUB, Impact("host", "k3", drivers=("a",)), Impact("host", "spare"), Impact("robot", "desk"))


def due(*hosts: str, target: str = "params/a.yaml", previous: str | None = "old") -> list[HostPlan]:
    return [HostPlan(host, previous, "new", (Step(Kind.UPDATE, target, "it changes"),)) for host in hosts]


def test_the_host_with_the_least_impact_comes_first() -> None:
    found = order(due("desk", "k3", "spare"), PARTS)
    assert found.waves == (("spare",), ("k3", "desk"))
    assert found.consistency == "independent"


def test_a_canary_then_a_quarter_then_the_rest() -> None:
    found = order(due(*(f"h{number:02}" for number in range(12))), ())
    assert [len(wave) for wave in found.waves] == [1, 3, 8]


@pytest.mark.parametrize(
    ("serial", "sizes"),
    [
        (["1"], [1] * 8),
        (["3"], [3, 3, 2]),
        (["1", "25%", "100%"], [1, 2, 5]),
        (["1%"], [1] * 8),
        (["50"], [8]),
    ],
)
def test_serial_says_how_many_change_at_a_time(serial: list[str], sizes: list[int]) -> None:
    found = order(due(*"abcdefgh"), (), serial)
    assert [len(wave) for wave in found.waves] == sizes


def test_a_first_deploy_has_one_wave() -> None:
    assert order(due("a", "b", "c", previous=None), ()).waves == (("a", "b", "c"),)
    assert len(order(due("a", previous=None) + due("b", "c"), ()).waves) == 2


def test_hosts_that_must_agree_change_together() -> None:
    plans = due("a", "b") + due("c", target="env/ros.env")
    found = order(plans, (), shared_files=NOETIC.shared_files)
    assert (found.waves, found.consistency, found.together) == ((("a", "b", "c"),), "all", True)
    chosen = order(plans, (), (), "wave", NOETIC.shared_files)
    assert (len(chosen.waves), chosen.consistency) == (2, "wave")
    first = order(due("a", target="env/ros.env", previous=None), (), shared_files=NOETIC.shared_files)
    assert first.consistency == "independent"


def test_nothing_to_do_has_no_waves() -> None:
    assert order([], ()).waves == ()
    assert order([], (), (), "all").waves == ()


@given(
    st.lists(st.text("abcdefgh", min_size=1), unique=True),
    st.lists(st.sampled_from(["1", "2", "30%", "100%"])),
)
def test_every_host_is_in_one_wave(hosts: list[str], serial: list[str]) -> None:
    waves = order(due(*hosts), PARTS, serial).waves
    assert sorted(host for wave in waves for host in wave) == sorted(hosts)
    assert all(waves)


@pytest.mark.parametrize("text", ["0", "0%", "101%", "-1", "1.5", "", "%", "all"])
def test_other_sizes_are_invalid(text: str) -> None:
    assert not valid_size(text)
