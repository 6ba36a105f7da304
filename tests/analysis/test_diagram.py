"""Any swarm whose names resolve can be drawn, checked and counted, even if most of it does not work."""

from __future__ import annotations

import pydot
from hypothesis import given, settings

from swarmctl.analysis.budgets import budgets_of
from swarmctl.analysis.diagram import diagram
from swarmctl.linter.runner import lint
from swarmctl.views.graph import dot, mermaid, overview
from tests.swarm.random_swarms import Data, index_of, swarms


@settings(max_examples=60)
@given(swarms())
def test_any_swarm_can_be_drawn(data: Data) -> None:
    index = index_of(data)
    lint(index.document)
    drawn = diagram(index)
    names = {*data["hosts"], *data["robots"], *data["programs"]}
    assert names <= {node.name for node in drawn.nodes}
    shown = overview.overview(drawn, details=True).plain
    assert names - set(data["robots"]) - set(data["programs"]) <= set(shown.split())
    [read] = pydot.graph_from_dot_data(dot.graph(drawn))
    ends = {(one.get_source().strip('"'), one.get_destination().strip('"')) for one in read.get_edges()}
    assert ends == {(edge.start, edge.end) for edge in drawn.edges}
    assert mermaid.graph(drawn).count("subgraph") == len(drawn.islands)
    assert len(budgets_of(index).lines) == len(data["robots"])
