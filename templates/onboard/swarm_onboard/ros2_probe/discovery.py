"""Whether a node that has just joined the graph has seen all of it. Knows no rclpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Iterator

from swarm_onboard.ros2_probe.endpoints import Graph, settled

if TYPE_CHECKING:
    from swarm_onboard.agent.observations import LaunchedSeen, NodeSeen
    from swarm_onboard.agent.verbs.probe import Request

LONGEST = 20.0  # s
_AT_LEAST = 2.0  # s, for nodes that nobody waits for
BOUND = 10.0  # s after which what is missing is a fault; lost announcements are repeated every 3 s
QUIET = 4.0  # s without a change after which nothing else is about to appear
_NOT_YET = "not all of it was seen, and the graph still changed when the look at it ended"


class Discovery:
    """Compares successive looks at the graph, of which the first begins at ``began``, s.

    ``finished``: no other look is needed; ``incomplete``: something expected is missing and may still appear.
    """

    def __init__(self, request: Request, began: float) -> None:
        self._request, self._began, self._changed = request, began, began
        self._contents: object = None
        self._missing: set[str] = set()
        self.finished = self.incomplete = False

    def look(self, graph: Graph, now: float) -> None:
        """Takes the next look."""
        before, self._contents = self._contents, _contents(graph)
        agrees = before == self._contents
        if not agrees:
            self._changed = now
        age, quiet = now - self._began, now - self._changed >= QUIET
        self._missing = set(_missing(graph, self._request))
        self.incomplete = bool(self._missing) and not quiet
        # A host leaves out optional nodes: these are waited for only while others appear.
        whole = agrees and not self._missing and (quiet or settled(graph, self._request))
        self.finished = age >= (_AT_LEAST if whole else LONGEST if self.incomplete else BOUND)

    def node(self, name: str, node: NodeSeen) -> NodeSeen:
        """Returns a node; unknown where an incomplete look has not seen all of it."""
        hidden = self.incomplete and name in self._missing
        return node._replace(registered=None, alive=None, error=_NOT_YET) if hidden else node

    def launched(self, unit: str, launched: LaunchedSeen) -> LaunchedSeen:
        """Returns the nodes of a unit; unknown where an incomplete look has not seen all of them."""
        hidden = self.incomplete and unit in self._missing
        return launched._replace(error=_NOT_YET) if hidden else launched


def _contents(graph: Graph) -> object:
    ends = (*graph.publishers, *graph.subscriptions)
    return sorted(graph.nodes), {(one.node, one.topic, one.gid) for one in ends}


def _missing(graph: Graph, request: Request) -> Iterator[str]:
    """Yields the expected nodes, and units of nodes, that the graph lacks, or a topic or service of them."""
    nodes = set(graph.nodes)
    named = {*request.nodes, *request.peers}
    publishing, subscribing = (
        {(one.node if one.node in named else "", one.topic) for one in ends if one.node in nodes}
        for ends in (graph.publishers, graph.subscriptions)
    )
    for one, wanted in request.expected.items():
        node = one if one.startswith("/") else ""
        ends = {(node, topic) for topic in wanted["publishes"]} - publishing
        ends |= {(node, topic) for topic in wanted["subscribes"]} - subscribing
        services = (graph.services.get(name, {}) for name in ([node] if node else nodes - named))
        lacks = set(wanted["provides"]) - {name for of_node in services for name in of_node}
        if ends or lacks or (node and node not in nodes):
            yield one
