"""Which publishers the static multimaster registers where, despite faults of masters, peers and itself."""

from __future__ import annotations

import pytest
from swarm_onboard.multimaster.graph import RECORD

from tests.onboard.multimaster.islands import (
    KIND,
    REMOVE,
    SILENT,
    World,
    address,
    sync_node,
)

PAIR = {"a": {"b": ["/b/odom", "/b/scan"]}, "b": {"a": ["/a/goal"]}}
RING = {"a": {"b": ["/chatter"]}, "b": {"c": ["/chatter"]}, "c": {"a": ["/chatter"]}}


@pytest.fixture
def pair() -> World:
    """a receives /b/odom and /b/scan from b; b receives /a/goal from a. The driver of b runs."""
    world = World(PAIR)
    world.publish("b", "/b/driver", "/b/odom")
    world.step()
    return world


def test_a_declared_topic_keeps_node_name_uri_and_type(pair: World) -> None:
    assert pair.masters["a"].publishers() >= pair.own("b")
    assert pair.masters["a"].types["/b/odom"] == KIND


def test_no_other_topic_is_bridged(pair: World) -> None:
    pair.publish("b", "/b/driver", "/b/cmd_vel", uri=pair.masters["b"].nodes["/b/driver"].uri)
    pair.publish("b", "/b/camera", "/b/image")
    pair.publish("a", "/a/planner", "/b/scan")  # a topic of b, published on a: not bridged to b
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert pair.brought("b") == set()


def test_each_bridge_subscribes_at_the_other_master(pair: World) -> None:
    here = pair.uris["a"]
    assert pair.masters["b"].subscribers() == {(topic, sync_node("a"), here) for topic in PAIR["a"]["b"]}


def test_an_unchanged_island_gets_no_updates(pair: World) -> None:
    pair.step(200)  # all renewals have passed
    pair.step()
    before = len(pair.masters["a"].updates), len(pair.masters["b"].updates)
    for _ in range(50):
        pair.step()
    assert (len(pair.masters["a"].updates), len(pair.masters["b"].updates)) == before


def test_a_foreign_publisher_is_not_forwarded() -> None:
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


def test_a_publisher_is_not_returned_to_its_island() -> None:
    world = World({"a": {"b": ["/chatter"]}, "b": {"a": ["/chatter"]}})
    world.publish("a", "/talker", "/chatter")
    for _ in range(3):
        world.step()
    assert world.brought("b") == {("/chatter", "/talker")}
    assert world.brought("a") == set()
    assert world.masters["a"].shut_down == []


def test_a_publisher_that_unregisters_is_removed(pair: World) -> None:
    uri = pair.masters["b"].nodes["/b/driver"].uri
    pair.masters["b"].unregisterPublisher("/b/driver", "/b/odom", uri)
    pair.step()
    assert pair.brought("a") == set()


def test_a_node_on_a_new_port_is_updated_without_a_shutdown(pair: World) -> None:
    uri = pair.publish("b", "/b/driver", "/b/odom")
    pair.publish("b", "/b/driver", "/b/scan", uri=uri)
    pair.step()
    assert pair.masters["a"].publishers() >= {("/b/odom", "/b/driver", uri), ("/b/scan", "/b/driver", uri)}
    assert len(pair.brought("a")) == 2
    assert pair.masters["a"].shut_down == []


@pytest.mark.parametrize("role", ["publishes", "subscribes"])
def test_a_local_node_of_the_same_name_is_never_overwritten(role: str) -> None:
    world = World(PAIR)
    here = world.uri("a")
    if role == "publishes":
        world.publish("a", "/b/driver", "/other", uri=here)
    else:
        world.masters["a"].registerSubscriber("/b/driver", "/other", KIND, here)
    world.publish("b", "/b/driver", "/b/odom")
    world.step()
    assert world.masters["a"].shut_down == []
    assert world.masters["a"].nodes["/b/driver"].uri == here
    assert reported(world, "refused /b/odom") == f"/b/driver: a node of that name runs here, at {here}"


def test_a_later_local_node_takes_its_name_until_it_unregisters(pair: World) -> None:
    uri = pair.publish("a", "/b/driver", "/other")
    pair.step()
    assert pair.masters["a"].nodes["/b/driver"].uri == uri
    pair.masters["a"].unregisterPublisher("/b/driver", "/other", uri)
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}


def test_of_two_foreign_nodes_with_one_name_the_first_stays() -> None:
    world = World({"a": {"b": ["/odom"], "c": ["/odom"]}, "b": {}, "c": {}})
    world.publish("c", "/driver", "/odom")
    world.step()
    world.publish("b", "/driver", "/odom")
    for _ in range(3):
        world.step()
    assert {uri for _, _, uri in world.masters["a"].publishers() if f"//{address('c')}:" in uri}
    assert world.masters["a"].shut_down == []
    assert reported(world, "refused /odom") == "/driver: island c has a node of that name too"


def test_a_publisher_of_another_type_is_refused() -> None:
    world = World(PAIR)
    world.publish("b", "/b/driver", "/b/odom", kind="std_msgs/Int8")
    world.step()
    assert world.brought("a") == set()
    assert (
        reported(world, "refused /b/odom")
        == "/b/driver: its type is std_msgs/Int8, declared is std_msgs/String"
    )


@pytest.mark.parametrize(
    "uri", ["http://127.0.0.1:4711/", "http://10.0.0.99:1/", "rosrpc://10.0.0.98:1/", "http://[::"]
)
def test_a_publisher_outside_the_peers_hosts_is_refused(uri: str) -> None:
    world = World(PAIR)
    world.publish("b", "/b/driver", "/b/odom", uri=uri)
    world.step()
    assert world.brought("a") == set()
    assert "which is not a host of island b" in reported(world, "refused /b/odom")
    assert message_of(world).startswith("1 of 1 peers connected; refused /b/odom of /b/driver: it runs at ")


def test_publishers_beyond_the_limit_are_refused() -> None:
    world = World(PAIR)
    for number in range(500):
        world.publish("b", f"/b/node{number}", "/b/odom")
    world.step()
    assert len(world.brought("a")) == 64
    assert reported(world, "refused /b/odom").endswith("more than 64 publishers")


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


def test_publishers_of_an_absent_peer_are_removed_and_restored(pair: World) -> None:
    pair.cut.add(frozenset("ab"))
    pair.step(REMOVE - 1)
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert reported(pair, "b") == "silent: no answer within 2 s"
    assert message_of(pair) == "0 of 1 peers connected; b: no answer within 2 s"
    pair.step(1)
    assert pair.brought("a") == set()
    assert reported(pair, "b") == "away: no answer within 2 s"
    pair.cut.clear()
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert reported(pair, "b") == "connected"


def test_after_a_silence_subscribers_get_repeated_updates(pair: World) -> None:
    pair.masters["a"].registerSubscriber("/listener", "/b/odom", KIND, pair.uri("a"))
    pair.step(200)
    updates_before = len(pair.masters["a"].updates)
    pair.cut.add(frozenset("ab"))
    pair.step(SILENT)
    pair.cut.clear()
    times = []
    for second in range(300):
        pair.step()
        if len(pair.masters["a"].updates) > updates_before:
            updates_before = len(pair.masters["a"].updates)
            times.append(second)
    assert times == [0, 10, 30, 75, 160]


def test_a_restarted_bridge_takes_over_its_registrations(pair: World) -> None:
    pair.bridges["a"] = None  # kill -9
    pair.publish("b", "/b/driver", "/b/odom")  # meanwhile the driver moved
    pair.start_bridge("a")
    pair.step()
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    assert pair.masters["a"].publishers() >= pair.own("b")
    assert [name for name, _ in pair.masters["a"].shut_down] == [sync_node("a")]  # its previous process


def test_a_restarted_bridge_keeps_an_absent_peer_for_its_time_only(pair: World) -> None:
    pair.bridges["a"] = None
    pair.cut.add(frozenset("ab"))
    pair.start_bridge("a")
    pair.step(REMOVE - 1)
    assert pair.brought("a") == {("/b/odom", "/b/driver")}
    pair.step(1)
    assert pair.brought("a") == set()


def test_topics_that_are_no_longer_declared_are_removed(pair: World) -> None:
    pair.bridges["a"] = None
    pair.start_bridge("a", {**PAIR, "a": {"b": ["/b/scan"]}})
    pair.step()
    assert pair.brought("a") == set()
    assert {topic for topic, _, _ in pair.masters["b"].subscribers()} == {"/b/scan"}


def test_it_unsubscribes_at_a_peer_without_topics(pair: World) -> None:
    pair.bridges["a"] = None
    pair.start_bridge("a", {**PAIR, "a": {"b": []}})
    pair.step()
    assert pair.masters["b"].subscribers() == set()


def test_a_stopped_bridge_unregisters_everything(pair: World) -> None:
    pair.stop_bridge("a")
    assert pair.masters["a"].publishers() == set()
    assert pair.masters["b"].subscribers() == set()
    assert RECORD not in pair.masters["a"].parameters


def test_a_bridge_that_stops_without_its_peer_unregisters_locally(pair: World) -> None:
    pair.cut.add(frozenset("ab"))
    pair.stop_bridge("a")
    assert pair.masters["a"].publishers() == set()


def test_a_deleted_or_damaged_record_is_written_again(pair: World) -> None:
    good = pair.masters["a"].parameters[RECORD]
    for damaged in (None, 7, [[1, 2, 3]], {"publishers": []}):
        pair.masters["a"].parameters[RECORD] = damaged or {}
        pair.step()
        assert pair.masters["a"].parameters[RECORD] == good
        assert pair.brought("a") == {("/b/odom", "/b/driver")}


def test_no_record_of_a_stranger_changes_what_is_joined(pair: World) -> None:
    for island, master in pair.masters.items():
        other = "b" if island == "a" else "a"
        entries = [[other, *entry] for entry in sorted(master.publishers())]
        master.parameters[RECORD] = [entries, []]
    before = {island: master.publishers() for island, master in pair.masters.items()}
    pair.step()
    assert {island: master.publishers() for island, master in pair.masters.items()} == before


def test_a_bridge_that_restarts_removes_no_node_of_its_own_island(pair: World) -> None:
    own = ("/a/odom", "/a/driver", pair.publish("a", "/a/driver", "/a/odom"))
    pair.bridges["a"] = None
    for island in ("b", "nowhere"):
        pair.masters["a"].parameters[RECORD] = [[[island, *own]], []]
        pair.start_bridge("a")
        pair.step()
        assert own in pair.masters["a"].publishers()


def message_of(world: World) -> str:
    """The message of the bridge of a."""
    bridge = world.bridges["a"]
    assert bridge
    return bridge.status().message


def reported(world: World, key: str) -> str:
    """The value of ``key`` in the diagnostics of the bridge of a."""
    bridge = world.bridges["a"]
    assert bridge
    return dict(bridge.status().values)[key]
