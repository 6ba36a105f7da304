"""The picture of any swarm: what it shows has a place, and no two places overlap."""

from __future__ import annotations

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.views.graph.svg import Box, layout


@st.composite
def diagrams(draw: st.DrawFn) -> Diagram:
    """Hosts on islands or on none, on any networks, with robots and programs; some without a host."""
    islands = [f"i{number}" for number in range(draw(st.integers(0, 4)))]
    networks = [Node("network", f"n{number}", "wlan") for number in range(draw(st.integers(0, 3)))]
    hosts, parts, edges = [], [], []
    for number in range(draw(st.integers(0, 30))):
        host = Node("host", f"h{number}", "", draw(st.sampled_from([*islands, ""])))
        hosts.append(host)
        edges += [Edge("network", host.id, network.id) for network in networks if draw(st.booleans())]
        for one in range(draw(st.integers(0, 5))):
            kind = draw(st.sampled_from(["robot", "program"]))
            parts.append(Node(kind, f"{host.name}-{one}", "", host.island))
            edges.append(Edge("runs" if kind == "program" else "serial", host.id, parts[-1].id))
    parts += [Node("robot", f"lone{number}", "") for number in range(draw(st.integers(0, 2)))]
    nodes = (*hosts, *parts, *networks)
    return Diagram("any", "leader", tuple((name, "") for name in islands), nodes, tuple(edges))


def inside(one: Box, other: Box) -> bool:
    return other.x <= one.x and other.y <= one.y and one.right <= other.right and one.bottom <= other.bottom


def apart(one: Box, other: Box) -> bool:
    beside = one.right <= other.x or other.right <= one.x
    return beside or one.bottom <= other.y or other.bottom <= one.y


@given(diagrams())
def test_everything_has_a_place_of_its_own(diagram: Diagram) -> None:
    found = layout(diagram)
    assert set(found.nodes) == {node.id for node in diagram.nodes}
    assert all(inside(box, found.size) for box in (*found.nodes.values(), *found.islands.values()))
    below = {edge.end: host for host, edges in found.parts.items() for edge in edges}
    for (name, one), (other, two) in combinations(found.nodes.items(), 2):
        if below.get(name) == other:
            assert inside(one, two)
        elif below.get(other) == name:
            assert inside(two, one)
        else:
            assert apart(one, two)
    assert all(apart(one, two) for one, two in combinations(found.islands.values(), 2))
    for node in diagram.nodes:
        if node.kind == "host" and node.island:
            assert inside(found.nodes[node.id], found.islands[node.island])


@given(diagrams())
def test_each_host_is_wired_to_its_networks_beside_the_others(diagram: Diagram) -> None:
    found = layout(diagram)
    taps = [(host, trunk.network) for trunk in found.trunks for host, _ in trunk.taps]
    assert sorted(taps) == sorted((edge.start, edge.end) for edge in diagram.edges if edge.kind == "network")
    lines = [trunk.x for trunk in found.trunks]
    assert len(lines) == len(set(lines))
    for trunk in found.trunks:
        assert trunk.top == found.nodes[trunk.network].bottom
        assert not any(
            box.x < trunk.x < box.right
            for name, box in found.nodes.items()
            if name.startswith(("host", "robot"))
        )
        for host, y in trunk.taps:
            assert found.nodes[host].y < y < found.nodes[host].bottom
            assert trunk.x < found.nodes[host].x
