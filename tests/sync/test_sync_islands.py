"""What the static multimaster brings where, whatever happens to masters, peers, nodes and itself."""

from __future__ import annotations

import pytest
from islands import KIND, REMOVE, SILENT, World, address, sync_node
from swarm_sync.graph import RECORD

PAIR = {"a": {"b": ["/b/odom", "/b/scan"]}, "b": {"a": ["/a/goal"]}}
RING = {"a": {"b": ["/chatter"]}, "b": {"c": ["/chatter"]}, "c": {"a": ["/chatter"]}}


@pytest.fixture
def pair() -> World:
    """a hears /b/odom and /b/scan of b; b hears /a/goal of a. /b's driver runs."""
    world = World(PAIR)
    world.publish("b", "/b/driver", "/b/odom")
    world.step()
    return world


def test_a_declared_topic_comes_with_name_uri_and_type_of_its_publisher(pair: World) -> None:
    assert pair.masters["a"].publishers() >= pair.own("b")
    assert pair.masters["a"].types["/b/odom"] == KIND


def test_nothing_else_comes(pair: World) -> None:
    pair.publish("b", "/b/driver", "/b/cmd_vel", uri=pair.masters["b"].nodes["/b/driver"].uri)
    pair.publish("b", "/b/camera", "/b/image")
    pair.publish("a", "/a/planner", "/b/scan")  # a topic of b, published on a: it does not go there
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert pair.brought("b") == set()


def test_each_listens_at_the_other_master_under_its_own_name_and_uri(pair: World) -> None:
    here = pair.uris["a"]
    assert pair.masters["b"].subscribers() == {(topic, sync_node("a"), here) for topic in PAIR["a"]["b"]}


def test_a_settled_island_is_left_alone(pair: World) -> None:
    pair.step(200)  # all renewals have passed
    pair.step()
    before = len(pair.masters["a"].told), len(pair.masters["b"].told)
    for _ in range(50):
        pair.step()
    assert (len(pair.masters["a"].told), len(pair.masters["b"].told)) == before


def test_what_came_from_elsewhere_goes_no_further() -> None:
    world = World(RING)
    for island in RING:
        world.publish(island, f"/{island}/talker", "/chatter")
    for _ in range(5):
        world.step()
    assert {island: world.brought(island) for island in RING} == {
        "a": {("/chatter", "/b/talker")},
        "b": {("/chatter", "/c/talker")},
        "c": {("/chatter", "/a/talker")},
    }


def test_nothing_comes_back_to_where_it_is_from() -> None:
    world = World({"a": {"b": ["/chatter"]}, "b": {"a": ["/chatter"]}})
    world.publish("a", "/talker", "/chatter")
    for _ in range(3):
        world.step()
    assert world.brought("b") == {("/chatter", "/talker")}
    assert world.brought("a") == set()
    assert world.masters["a"].shut_down == []


def test_a_publisher_that_leaves_is_taken_out(pair: World) -> None:
    uri = pair.masters["b"].nodes["/b/driver"].uri
    pair.masters["b"].unregisterPublisher("/b/driver", "/b/odom", uri)
    pair.step()
    assert pair.brought("a") == set()


def test_a_node_that_moved_to_another_port_is_moved_and_nobody_is_shut_down(pair: World) -> None:
    uri = pair.publish("b", "/b/driver", "/b/odom")
    pair.publish("b", "/b/driver", "/b/scan", uri=uri)
    pair.step()
    assert pair.masters["a"].publishers() >= {("/b/odom", "/b/driver", uri), ("/b/scan", "/b/driver", uri)}
    assert len(pair.brought("a")) == 2
    assert pair.masters["a"].shut_down == []


@pytest.mark.parametrize("does", ["publishes", "hears"])
def test_a_local_node_of_the_same_name_is_never_overwritten(does: str) -> None:
    world = World(PAIR)
    here = world.uri("a")
    if does == "publishes":
        world.publish("a", "/b/driver", "/else", uri=here)
    else:
        world.masters["a"].registerSubscriber("/b/driver", "/else", KIND, here)
    world.publish("b", "/b/driver", "/b/odom")
    world.step()
    assert world.masters["a"].shut_down == []
    assert world.masters["a"].nodes["/b/driver"].uri == here
    assert told(world, "refused /b/odom") == f"/b/driver: a node of that name runs here, at {here}"


def test_a_local_node_that_comes_later_keeps_its_name_and_gives_it_back(pair: World) -> None:
    uri = pair.publish("a", "/b/driver", "/else")
    pair.step()
    assert pair.masters["a"].nodes["/b/driver"].uri == uri
    pair.masters["a"].unregisterPublisher("/b/driver", "/else", uri)
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}


def test_of_two_islands_nodes_with_one_name_the_first_stays() -> None:
    world = World({"a": {"b": ["/odom"], "c": ["/odom"]}, "b": {}, "c": {}})
    world.publish("c", "/driver", "/odom")
    world.step()
    world.publish("b", "/driver", "/odom")
    for _ in range(3):
        world.step()
    assert {uri for _, _, uri in world.masters["a"].publishers() if f"//{address('c')}:" in uri}
    assert world.masters["a"].shut_down == []
    assert told(world, "refused /odom") == "/driver: island c has a node of that name too"


def test_a_publisher_of_another_type_is_refused() -> None:
    world = World(PAIR)
    world.publish("b", "/b/driver", "/b/odom", kind="std_msgs/Int8")
    world.step()
    assert world.brought("a") == set()
    assert (
        told(world, "refused /b/odom") == "/b/driver: its type is std_msgs/Int8, declared is std_msgs/String"
    )


@pytest.mark.parametrize(
    "uri", ["http://127.0.0.1:4711/", "http://10.0.0.99:1/", "rosrpc://10.0.0.98:1/", "http://[::"]
)
def test_a_publisher_at_a_host_that_is_not_the_peers_is_refused(uri: str) -> None:
    world = World(PAIR)
    world.publish("b", "/b/driver", "/b/odom", uri=uri)
    world.step()
    assert world.brought("a") == set()
    assert "which is no host of island b" in told(world, "refused /b/odom")


def test_a_flood_of_publishers_is_cut_off() -> None:
    world = World(PAIR)
    for number in range(500):
        world.publish("b", f"/b/node{number}", "/b/odom")
    world.step()
    assert len(world.brought("a")) == 64
    assert told(world, "refused /b/odom").endswith("more than 64 publishers")


def test_the_own_master_restarts(pair: World) -> None:
    pair.restart_master("a")
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert ("/diagnostics", sync_node("a"), pair.uris["a"]) in pair.masters["a"].publishers()


def test_the_peers_master_restarts(pair: World) -> None:
    pair.restart_master("b")
    pair.step()
    assert pair.brought("a") == set()
    pair.publish("b", "/b/driver", "/b/odom")
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert len(pair.masters["b"].subscribers()) == 2


def test_a_peer_that_is_away_loses_its_publishers_after_a_time_and_gets_them_back(pair: World) -> None:
    pair.cut.add(frozenset("ab"))
    pair.step(REMOVE - 1)
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert told(pair, "b") == "silent: no answer within 2 s"
    pair.step(1)
    assert pair.brought("a") == set()
    assert told(pair, "b") == "away: no answer within 2 s"
    pair.cut.clear()
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert told(pair, "b") == "connected"


def test_after_a_silence_subscribers_are_told_again_and_again_for_a_while(pair: World) -> None:
    pair.masters["a"].registerSubscriber("/listener", "/b/odom", KIND, pair.uri("a"))
    pair.step(200)
    told_before = len(pair.masters["a"].told)
    pair.cut.add(frozenset("ab"))
    pair.step(SILENT)
    pair.cut.clear()
    times = []
    for second in range(300):
        pair.step()
        if len(pair.masters["a"].told) > told_before:
            told_before = len(pair.masters["a"].told)
            times.append(second)
    assert times == [0, 10, 30, 75, 160]


def test_a_killed_bridge_finds_what_it_left_behind(pair: World) -> None:
    pair.bridges["a"] = None  # kill -9
    pair.publish("b", "/b/driver", "/b/odom")  # meanwhile the driver moved
    pair.start_bridge("a")
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert pair.masters["a"].publishers() >= pair.own("b")
    assert [name for name, _ in pair.masters["a"].shut_down] == [sync_node("a")]  # its own old self


def test_a_killed_bridge_keeps_what_is_from_a_peer_that_is_away_for_its_time_only(pair: World) -> None:
    pair.bridges["a"] = None
    pair.cut.add(frozenset("ab"))
    pair.start_bridge("a")
    pair.step(REMOVE - 1)
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    pair.step(1)
    assert pair.brought("a") == set()


def test_after_a_new_configuration_what_is_no_longer_declared_is_taken_out(pair: World) -> None:
    pair.bridges["a"] = None
    pair.start_bridge("a", {**PAIR, "a": {"b": ["/b/scan"]}})
    pair.step()
    assert pair.brought("a") == set()
    assert {topic for topic, _, _ in pair.masters["b"].subscribers()} == {"/b/scan"}


def test_after_a_new_configuration_it_listens_nowhere_in_vain(pair: World) -> None:
    pair.bridges["a"] = None
    pair.start_bridge("a", {**PAIR, "a": {"b": []}})
    pair.step()
    assert pair.masters["b"].subscribers() == set()


def test_who_stops_leaves_nothing_behind(pair: World) -> None:
    pair.stop_bridge("a")
    assert pair.masters["a"].publishers() == set()
    assert pair.masters["b"].subscribers() == set()
    assert RECORD not in pair.masters["a"].parameters


def test_who_stops_while_a_peer_is_away_cleans_up_at_home(pair: World) -> None:
    pair.cut.add(frozenset("ab"))
    pair.stop_bridge("a")
    assert pair.masters["a"].publishers() == set()


def test_a_record_that_somebody_deleted_or_spoilt_is_written_again(pair: World) -> None:
    good = pair.masters["a"].parameters[RECORD]
    for spoilt in (None, 7, [[1, 2, 3]], {"publishers": []}):
        pair.masters["a"].parameters[RECORD] = spoilt or {}
        pair.step()
        assert pair.masters["a"].parameters[RECORD] == good
        assert pair.brought("a") == {("/b/odom", "/b/driver")}


def told(world: World, key: str) -> str:
    """What the bridge of a says about ``key`` in its diagnostics."""
    bridge = world.bridges["a"]
    assert bridge
    return dict(bridge.status().values)[key]
