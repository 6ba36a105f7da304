"""From the joystick to the wheel: every hop, and the reason where there is none."""

from __future__ import annotations

import networkx as nx
import pytest
from hypothesis import given, settings
from random_swarms import Data, spec_of, swarms
from test_impact import COMBINED, LED, THREE, Life

from swarmctl.topology.graph import graph_of, host_node
from swarmctl.topology.paths import way, ways
from swarmctl.topology.wiring import Wiring

JOYSTICK: Data = {
    "programs": {"joystick": {"host": "laptop", "use": "teleop-joy"}},
    "control": [{"by": "joystick", "of": ["k3", "epuck"]}],
}


def hops(data: Data, by: str, robot: str) -> list[str]:
    return [f"{hop.kind} {hop.name}" for hop in way(Wiring(spec_of(data)), by, robot).hops]


@pytest.mark.parametrize(
    ("mode", "more", "expected"),
    [
        ("leader", {"leader": "laptop"},
         ["program joystick", "host laptop", "network lab", "master three", "host epuck-pi",
          "adapter epuck-pi/hci0", "line epuck", "robot epuck"]),
        ("standalone", {},
         ["program joystick", "host laptop", "network lab", "bridge laptop to epuck-pi", "host epuck-pi",
          "adapter epuck-pi/hci0", "line epuck", "robot epuck"]),
        ("combined", COMBINED,
         ["program joystick", "host laptop", "network lab", "master big", "host epuck-pi",
          "adapter epuck-pi/hci0", "line epuck", "robot epuck"]),
    ],
)  # fmt: skip
def test_a_joysticks_order_reaches_the_wheel(mode: str, more: Data, expected: list[str]) -> None:
    assert hops({**THREE, **JOYSTICK, "mode": mode, **more}, "joystick", "epuck") == expected


def test_on_one_host_no_network_is_passed() -> None:
    assert hops({**THREE, **LED, "mode": "leader", "leader": "laptop"}, "laptop", "koala") == [
        "host laptop", "master three", "line koala", "robot koala"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (
            {**JOYSTICK, "mode": "leader", "leader": "laptop"},
            "`control` does not let `joystick` command `koala`",
        ),
        ({**LED, "mode": "standalone", "links": THREE["links"][1:]}, ""),
    ],
)
def test_why_an_order_has_no_way(data: Data, why: str) -> None:
    by = data["control"][0]["by"]
    assert way(Wiring(spec_of({**THREE, **data})), by, "koala").why == why


def test_two_islands_without_a_network_between_them() -> None:
    data = {**THREE, **LED, "mode": "standalone", "links": THREE["links"][1:]}
    found = {one.robot: one.why for one in ways(Wiring(spec_of(data)))}
    assert found == {
        "koala": "",
        "k3": "no network joins `laptop` and `k3-pi`",
        "epuck": "no network joins `laptop` and `epuck-pi`",
    }


def test_a_host_without_ros_commands_nobody() -> None:
    data = {
        **THREE,
        "mode": "single-minded",
        "leader": "laptop",
        "control": [{"by": "k3-pi", "of": ["koala"]}],
    }
    [found] = ways(Wiring(spec_of(data)))
    assert found.why == "host `k3-pi` runs no ROS in mode single-minded"


@settings(max_examples=100, deadline=None)
@given(swarms())
def test_there_is_a_way_exactly_where_an_order_arrives(data: Data) -> None:
    life, wiring = Life(data, None), Wiring(spec_of(data))
    for one in ways(wiring):
        assert bool(one.hops) == life.commands(one.by, one.robot)
        assert bool(one.hops) != bool(one.why)


@settings(max_examples=100, deadline=None)
@given(swarms())
def test_no_way_between_hosts_is_shorter(data: Data) -> None:
    """The hosts and networks of a way are a shortest path of the graph."""
    spec = spec_of(data)
    graph = graph_of(spec)
    for one in ways(Wiring(spec)):
        walked = [(hop.kind, hop.name) for hop in one.hops if hop.kind in ("host", "network")]
        if walked:
            assert nx.is_path(graph, walked)
            ends = host_node(walked[0][1]), host_node(walked[-1][1])
            assert len(walked) == len(nx.shortest_path(graph, *ends))
