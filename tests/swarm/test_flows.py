"""Who may reach what: from islands, bridges, multimaster and clocks, and from nothing else."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from swarmctl.spec.model import Spec
from swarmctl.swarm.discovery import Discovery
from swarmctl.swarm.flow import Flow, Service, peers_of
from swarmctl.swarm.flows import flows_of, ros_flows
from swarmctl.swarm.resolved import Bridge, Island
from tests import ROOT
from tests.loading import load_swarm

LAPTOP, K3, EPUCK = "koala-laptop", "k3-pi", "epuck-pi"


def flows(*names: str) -> list[tuple[str, str, str, str]]:
    """From, service, hosts and cause of each flow of an example; overlays may follow."""
    swarm, _ = load_swarm(*(ROOT / "examples" / name for name in names))
    assert swarm is not None
    return [
        (" ".join(one.sources), one.service.name, " ".join(one.hosts), one.cause) for one in flows_of(swarm)
    ]


def test_in_an_island_nodes_reach_the_master_and_each_other() -> None:
    everybody = f"{LAPTOP} {K3} {EPUCK}"
    assert flows("paper-leader/swarm.yaml") == [
        (f"{K3} {EPUCK}", "MASTER", LAPTOP, "island newswarm"),
        (everybody, "NODES", everybody, "island newswarm"),
        (f"{K3} {EPUCK}", "CLOCK", LAPTOP, "follows its time"),
        ("", "SSH", everybody, "swarmctl and people log in"),
    ]


def test_islands_reach_each_other_only_for_the_topics_that_cross() -> None:
    crossing = [one for one in flows("paper-4-standalone/swarm.yaml") if "cmd_vel" in one[3]]
    assert crossing == [
        (K3, "MASTER", LAPTOP, "receives /k3/cmd_vel"),
        (K3, "NODES", LAPTOP, "receives /k3/cmd_vel"),
        (LAPTOP, "NODES", K3, "announces /k3/cmd_vel"),
        (EPUCK, "MASTER", LAPTOP, "receives /epuck/cmd_vel"),
        (EPUCK, "NODES", LAPTOP, "receives /epuck/cmd_vel"),
        (LAPTOP, "NODES", EPUCK, "announces /epuck/cmd_vel"),
    ]


def test_a_relay_and_the_island_of_its_topics_reach_each_other() -> None:
    crossing = [one for one in flows("ros2-4-standalone/swarm.yaml") if "cmd_vel" in one[3]]
    assert crossing == [
        (K3, "NODES", LAPTOP, "receives /k3/cmd_vel"),
        (LAPTOP, "NODES", K3, "sends /k3/cmd_vel"),
        (EPUCK, "NODES", LAPTOP, "receives /epuck/cmd_vel"),
        (LAPTOP, "NODES", EPUCK, "sends /epuck/cmd_vel"),
    ]


def test_a_relay_of_zenoh_reaches_the_router_of_its_topics(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    text = (ROOT / "examples/ros2-4-standalone/swarm.yaml").read_text("utf-8")
    spec.write_text(text.replace("{distro: jazzy}", "{distro: kilted, rmw: zenoh}"), "utf-8")
    assert [one for one in flows(str(spec)) if "cmd_vel" in one[3]] == [
        (K3, "NODES", LAPTOP, "receives /k3/cmd_vel"),
        (EPUCK, "NODES", LAPTOP, "receives /epuck/cmd_vel"),
    ]


def test_a_relay_and_an_island_of_ros_1_reach_each_other() -> None:
    crossing = [one for one in flows("ros1-and-ros2/swarm.yaml") if "cmd_vel" in one[3]]
    there, back = "/tb3/cmd_vel, /koala/odom", "/koala/cmd_vel, /tb3/scan"
    assert sorted(crossing) == sorted(
        [
            ("tb3-pi", "MASTER", LAPTOP, f"joins {there}"),
            ("tb3-pi", "NODES", LAPTOP, f"receives {there}"),
            (LAPTOP, "MULTIMASTER", "tb3-pi", f"exchanges {there}"),
            ("tb3-pi", "MASTER", LAPTOP, f"joins {back}"),
            (LAPTOP, "MULTIMASTER", "tb3-pi", f"exchanges {back}"),
        ]
    )


def test_masters_that_discover_each_other_reach_each_other() -> None:
    found = flows("paper-5-combined/swarm.yaml", "paper-5-combined/fkie.yaml")
    hubs = f"{LAPTOP} {K3} {EPUCK}"
    assert (hubs, "MULTIMASTER", hubs, "discovers masters") in found
    assert (hubs, "MASTER", hubs, "discovers masters") in found


def test_a_graph_without_a_master_has_no_flow_to_one() -> None:
    assert not [one for one in flows("ros2-2-leader/swarm.yaml") if one[1] == "MASTER"]


@given(st.data())
def test_hosts_are_peers_if_an_island_or_a_topic_joins_them(data: st.DataObject) -> None:
    """Random swarms, against the definition: nobody else is a peer."""
    sizes = data.draw(st.lists(st.integers(1, 4), min_size=1, max_size=6))
    islands = [
        Island(
            f"i{number}",
            f"h{number}-0",
            tuple(f"h{number}-{one}" for one in range(size)),
            "noetic",
            11311,
            Discovery(),
        )
        for number, size in enumerate(sizes)
    ]
    pairs = st.tuples(st.sampled_from(islands), st.sampled_from(islands)).filter(
        lambda one: one[0] is not one[1]
    )
    joined = data.draw(st.lists(pairs, max_size=6)) if len(islands) > 1 else []
    bridges = [Bridge(f"/t{n}", "", a.name, (b.name,), "") for n, (a, b) in enumerate(joined)]
    spec = Spec.model_validate(
        {
            "version": 1,
            "name": "any",
            "mode": "standalone",
            "multimaster": {"provider": "static"},
            "hosts": {"a": {"address": "10.0.0.1"}},
            "robots": {"k3": {"type": "khepera3", "host": "a"}},
        }
    )
    peers = peers_of(ros_flows(spec, islands, bridges))
    linked = {frozenset((a.name, b.name)) for a, b in joined}
    for first in islands:
        for second in islands:
            near = first is second or frozenset((first.name, second.name)) in linked
            for one in first.hosts:
                for other in second.hosts:
                    assert (other in peers.get(one, ())) == (near and one != other)


def test_a_host_is_no_peer_of_itself_or_of_its_clock() -> None:
    followed = Flow(("a",), ("b",), Service.CLOCK, "follows its time")
    assert peers_of([followed]) == {}
    assert peers_of([Flow(("a", "b"), ("a", "b"), Service.NODES, "island x")]) == {
        "a": frozenset({"b"}),
        "b": frozenset({"a"}),
    }
