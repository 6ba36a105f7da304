"""After any sequence of events on three islands, nothing leaks and all masters match the configuration."""

from __future__ import annotations

from typing import Any

import hypothesis.strategies as st
from hypothesis import given, settings
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from swarm_onboard.common.xmlrpc import NonsenseError
from swarm_onboard.multimaster import graph, reconcile
from swarm_onboard.multimaster.graph import Entry, Graph, Record

from tests.onboard.multimaster.islands import REMOVE, World, address, sync_node

ISLANDS = ("a", "b", "c")
COMMON = "/chatter"
DECLARED = {
    here: {there: [f"/{there}/odom", COMMON] for there in ISLANDS if there != here} for here in ISLANDS
}
NAMES = [f"/{island}/node{number}" for island in ISLANDS for number in (1, 2)] + ["/shared"]

islands = st.sampled_from(ISLANDS)
topics = st.sampled_from([*(f"/{island}/odom" for island in ISLANDS), COMMON, "/undeclared"])


class Islands(RuleBasedStateMachine):
    """The real bridges against masters in memory. Node names differ between islands, except one."""

    def __init__(self) -> None:
        super().__init__()
        self.world = World(DECLARED)

    @rule(island=islands, name=st.sampled_from(["node1", "node2", "shared"]), topic=topics)
    def publish(self, island: str, name: str, topic: str) -> None:
        node = "/shared" if name == "shared" else f"/{island}/{name}"
        known = self.world.masters[island].nodes.get(node)
        home = known is not None and f"//{address(island)}:" in known.uri
        self.world.publish(island, node, topic, uri=known.uri if known and home else "")

    @rule(island=islands, name=st.sampled_from(["node1", "node2"]))
    def restart_node(self, island: str, name: str) -> None:
        self.world.publish(island, f"/{island}/{name}", f"/{island}/odom")

    @rule(island=islands, name=st.sampled_from(NAMES))
    def stop_node(self, island: str, name: str) -> None:
        for topic, node, uri in self.world.own(island):
            if node == name:
                self.world.masters[island].unregisterPublisher(node, topic, uri)

    @rule(island=islands)
    def restart_master(self, island: str) -> None:
        self.world.restart_master(island)

    @rule(one=islands, other=islands)
    def cut(self, one: str, other: str) -> None:
        self.world.cut |= {frozenset({one, other})} if one != other else set()

    @rule()
    def heal(self) -> None:
        self.world.cut.clear()

    @rule(island=islands)
    def kill_bridge(self, island: str) -> None:
        self.world.bridges[island] = None

    @rule(island=islands)
    def stop_bridge(self, island: str) -> None:
        self.world.stop_bridge(island)

    @precondition(lambda self: None in self.world.bridges.values())
    @rule()
    def start_bridges(self) -> None:
        for island, bridge in self.world.bridges.items():
            if not bridge:
                self.world.start_bridge(island)

    @rule(seconds=st.sampled_from([1.0, REMOVE]))
    def time_passes(self, seconds: float) -> None:
        before = {island: len(master.shut_down) for island, master in self.world.masters.items()}
        self.world.step(seconds)
        for island, master in self.world.masters.items():
            bridges = {sync_node(name) for name in ISLANDS}
            assert [one for one in master.shut_down[before[island] :] if one[0] not in bridges] == []

    @invariant()
    def nothing_leaks(self) -> None:
        for island in ISLANDS:
            hosts = {f"//{address(peer)}:": set(names) for peer, names in DECLARED[island].items()}
            for topic, node, uri in self.world.masters[island].publishers():
                declared = next((names for host, names in hosts.items() if host in uri), None)
                assert declared is None or topic in declared, f"{topic} of {node} leaked to {island}"

    def teardown(self) -> None:
        self.world.cut.clear()
        self.start_bridges()
        for _ in range(3):
            self.world.step()
        for island in ISLANDS:
            own, brought = self.world.own(island), self.world.brought(island)
            local = {node for _, node, _ in own}
            offered = {
                (topic, node)
                for peer, names in DECLARED[island].items()
                for topic, node, _ in self.world.own(peer)
                if topic in names and node not in local
            }
            assert {one for one in brought if one[1] != "/shared"} == {
                one for one in offered if one[1] != "/shared"
            }
            assert brought <= offered
            assert ("/shared" in {node for _, node in brought}) == (
                "/shared" in {node for _, node in offered}
            )
            listening = {
                (topic, sync_node(peer), self.world.uris[peer])
                for peer in ISLANDS
                if peer != island
                for topic in DECLARED[peer][island]
            }
            assert self.world.masters[island].subscribers() == listening
        for island in ISLANDS:
            self.world.stop_bridge(island)
        assert all(self.world.masters[island].publishers() == self.world.own(island) for island in ISLANDS)
        assert all(not self.world.masters[island].subscribers() for island in ISLANDS)


Islands.TestCase.settings = settings(max_examples=60, stateful_step_count=30)
TestIslands = Islands.TestCase


names = st.sampled_from(["/n1", "/n2", "/n3"])
uris = st.sampled_from([f"http://10.0.0.{number}:{port}/" for number in (1, 2) for port in (1, 2)])
entries = st.builds(Entry, st.sampled_from(["/t1", "/t2"]), names, uris)
records = st.dictionaries(entries, st.sampled_from(["b", "c"]), max_size=6)
graphs = st.builds(
    lambda found, nodes: Graph(frozenset(found), frozenset(), {}, nodes, Record()),
    st.sets(st.tuples(st.sampled_from(["/t1", "/t2"]), names)),
    st.dictionaries(names, uris),
)


@given(wanted=records, own=graphs, brought=records)
def test_a_plan_never_touches_registrations_of_other_nodes(
    wanted: dict[Entry, str], own: Graph, brought: dict[Entry, str]
) -> None:
    plan = reconcile.plan_for(wanted, own, brought)
    assert all(own.nodes.get(entry.node, entry.uri) == entry.uri for entry in plan.add)
    assert set(plan.drop) <= brought.keys() - wanted.keys()
    assert set(plan.add) <= wanted.keys()
    assert {*plan.add, *plan.drop} <= plan.brought.keys()


junk = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5) | names,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=12,
)


@given(state=junk, types=junk, record=junk, uri=junk)
def test_any_answer_of_a_master_is_a_graph_or_rejected(state: Any, types: Any, record: Any, uri: Any) -> None:
    answers = [(1, state), (1, types), (1, record), (1, uri)]
    try:
        found = graph.read(answers, "/me", ["/me"], {"/t1"})
    except NonsenseError:
        return
    assert {topic for topic, _ in found.publishers} <= {"/t1"}


@given(entries=records, masters=st.sets(uris))
def test_a_record_is_read_as_it_was_written(entries: dict[Entry, str], masters: set[str]) -> None:
    record = Record(entries, frozenset(masters))
    assert graph.unpacked(record.packed()) == record
