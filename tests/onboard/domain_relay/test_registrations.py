"""What the relay registers at a master of ROS 1: no name of another node, and nothing old is left."""

from __future__ import annotations

from swarm_onboard.domain_relay.registrations import Plan, plan_for, publishers
from swarm_onboard.multimaster.graph import Entry, Graph, Record

ADDRESS, TOPIC = "10.0.0.2", "/cmd_vel"
OURS, OLD, ELSEWHERE = "http://10.0.0.2:40001/", "http://10.0.0.2:39001/", "http://10.0.0.1:40001/"
WANTED = Entry(TOPIC, "/joystick", OURS)


def planned(wanted: set[Entry], *present: Entry, **nodes: str) -> Plan:
    """The plan at a master that has the entries, and the nodes besides."""
    graph = Graph(
        publishers=frozenset((one.topic, one.node) for one in present),
        subscribed=frozenset(),
        types={},
        nodes={**{one.node: one.uri for one in present}, **{f"/{name}": uri for name, uri in nodes.items()}},
        record=Record(),
    )
    return plan_for(wanted, graph, ADDRESS, [TOPIC])


def test_what_is_missing_is_added_and_what_is_there_stays() -> None:
    assert planned({WANTED}) == Plan((), (WANTED,), ())
    assert planned({WANTED}, joystick=OURS) == Plan((), (WANTED,), ())  # with another topic
    assert planned({WANTED}, WANTED) == Plan((), (), ())


def test_what_a_node_left_that_has_gone_is_removed() -> None:
    assert planned(set(), WANTED) == Plan((WANTED,), (), ())


def test_what_an_earlier_run_left_is_removed_before_its_name_is_taken() -> None:
    """Registered at once, it would be shut down by the master."""
    assert planned({WANTED}, Entry(TOPIC, "/joystick", OLD)) == Plan(
        (Entry(TOPIC, "/joystick", OLD),), (), ()
    )


def test_a_name_of_a_node_elsewhere_is_refused() -> None:
    for plan in (
        planned({WANTED}, joystick=ELSEWHERE),
        planned({WANTED}, Entry(TOPIC, "/joystick", ELSEWHERE)),
    ):
        assert (plan.drop, plan.add) == ((), ())
        assert plan.refused == (f"{TOPIC} of /joystick: a node of that name runs there, at {ELSEWHERE}",)


def test_other_topics_and_other_hosts_are_left_alone() -> None:
    plan = planned(set(), Entry("/odom", "/driver", OURS), Entry(TOPIC, "/planner", ELSEWHERE))
    assert plan == Plan((), (), ())


def test_of_a_flood_of_publishers_a_part_is_looked_up() -> None:
    flood = frozenset((TOPIC, f"/a{number}") for number in range(1000))
    graph = Graph(flood, frozenset(), {}, {}, Record())
    assert len(publishers(graph, [TOPIC])) == 128
