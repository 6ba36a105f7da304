"""The spec as a graph: hosts, robots and networks are its nodes, links its edges."""

from __future__ import annotations

import networkx as nx

from swarmctl.spec.model import Bluetooth, Ethernet, Serial, Spec, Wlan

Node = tuple[str, str]


def host_node(name: str) -> Node:
    return ("host", name)


def robot_node(name: str) -> Node:
    return ("robot", name)


def network_node(name: str) -> Node:
    return ("network", name)


def graph_of(spec: Spec) -> nx.Graph[Node]:
    """Nodes are ``(kind, name)``; edges of serial and Bluetooth lines carry ``link``, their index."""
    graph: nx.Graph[Node] = nx.Graph()
    graph.add_nodes_from(host_node(name) for name in spec.hosts)
    graph.add_nodes_from(robot_node(name) for name in spec.robots)
    for index, link in enumerate(spec.links):
        match link:
            case Wlan() | Ethernet():
                graph.add_edges_from((host_node(host), network_node(link.name)) for host in link.hosts)
            case Serial() | Bluetooth():
                graph.add_edge(host_node(link.host), robot_node(link.robot), link=index)
    return graph
