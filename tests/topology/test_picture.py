"""Any swarm whose names fit together can be drawn, checked and counted, however little of it works."""

from __future__ import annotations

import json

import pydot
from hypothesis import given, settings
from random_swarms import Data, swarms

from swarmctl.checks.check import check
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.topology.budgets import budgets_of
from swarmctl.topology.picture import picture
from swarmctl.views.graph import dot, mermaid, overview


@settings(max_examples=60, deadline=None)
@given(swarms())
def test_any_swarm_can_be_drawn(data: Data) -> None:
    document, found = load_text(json.dumps(data), "random.yaml", load_catalog())
    assert document is not None, found
    check(document)
    drawn = picture(document.spec, document.types)
    names = {*data["hosts"], *data["robots"], *data["programs"]}
    assert names <= {node.name for node in drawn.nodes}
    assert names - set(data["robots"]) - set(data["programs"]) <= set(overview.overview(drawn).plain.split())
    [read] = pydot.graph_from_dot_data(dot.graph(drawn))
    ends = {(one.get_source().strip('"'), one.get_destination().strip('"')) for one in read.get_edges()}
    assert ends == {(edge.start, edge.end) for edge in drawn.edges}
    assert mermaid.graph(drawn).count("subgraph") == len(drawn.islands)
    assert len(budgets_of(document).lines) == len(data["robots"])
