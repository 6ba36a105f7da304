"""The path of a command from the joystick to the wheel, or the reason why there is none."""

from __future__ import annotations

import networkx as nx
import pytest
from hypothesis import given, settings

from swarmctl.analysis.command_paths import command_path, command_paths
from tests.analysis.test_impact import COMBINED, LED, THREE, Life
from tests.swarm.random_swarms import Data, index_of, swarms

JOYSTICK: Data = {
    "programs": {"joystick": {"host": "laptop", "use": "teleop-joy"}},
    "control": [{"by": "joystick", "of": ["k3", "epuck"]}],
}


def hops(data: Data, by: str, robot: str) -> list[str]:
    return [f"{hop.kind} {hop.name}" for hop in command_path(index_of(data), by, robot).hops]


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
def test_the_path_from_a_joystick_to_the_robot(mode: str, more: Data, expected: list[str]) -> None:
    assert hops({**THREE, **JOYSTICK, "mode": mode, **more}, "joystick", "epuck") == expected


def test_a_path_on_one_host_has_no_network() -> None:
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
def test_why_a_command_has_no_path(data: Data, why: str) -> None:
    by = data["control"][0]["by"]
    assert command_path(index_of({**THREE, **data}), by, "koala").why == why


def test_no_path_between_islands_without_a_common_network() -> None:
    data = {**THREE, **LED, "mode": "standalone", "links": THREE["links"][1:]}
    found = {one.robot: one.why for one in command_paths(index_of(data))}
    assert found == {
        "koala": "",
        "k3": "no network joins `laptop` and `k3-pi`",
        "epuck": "no network joins `laptop` and `epuck-pi`",
    }


def test_no_path_from_a_host_without_ros() -> None:
    data = {
        **THREE,
        "mode": "single-minded",
        "leader": "laptop",
        "control": [{"by": "k3-pi", "of": ["koala"]}],
    }
    [found] = command_paths(index_of(data))
    assert found.why == "host `k3-pi` runs no ROS in mode single-minded"


@settings(max_examples=100)
@given(swarms())
def test_there_is_a_path_exactly_if_a_command_arrives(data: Data) -> None:
    life = Life(data, None)
    for one in command_paths(index_of(data)):
        assert bool(one.hops) == life.commands(one.by, one.robot)
        assert bool(one.hops) != bool(one.why)


@settings(max_examples=100)
@given(swarms())
def test_no_path_between_the_hosts_is_shorter(data: Data) -> None:
    """The hosts and networks of a path are a shortest path of the graph."""
    index = index_of(data)
    graph = nx.Graph()
    graph.add_nodes_from(("host", host) for host in data["hosts"])
    graph.add_edges_from(
        (("host", host), ("network", link.name)) for _, link in index.networks for host in link.hosts
    )
    for one in command_paths(index):
        walked = [(hop.kind, hop.name) for hop in one.hops if hop.kind in ("host", "network")]
        if walked:
            assert nx.is_path(graph, walked)
            assert len(walked) == len(nx.shortest_path(graph, walked[0], walked[-1]))
