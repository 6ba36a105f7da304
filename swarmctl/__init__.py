"""swarmctl: one YAML file describes a robot swarm; swarmctl checks, renders, deploys and watches it."""

from __future__ import annotations

from swarmctl.version import __version__

TYPE_CHECKING = False  # of `typing`, whose import takes longer than all else before the first verb
if TYPE_CHECKING:
    from os import PathLike

    from swarmctl.analysis.swarm_graph import Graph, Node

__all__ = ["__version__", "graph"]


def graph(*files: str | PathLike[str]) -> Graph[Node]:
    """Returns the graph of a spec with its overlays, of networkx (docs/graph.md).

    Raises ValueError with the errors of a spec that has some, each with its place.
    """
    from pathlib import Path

    from swarmctl.analysis.swarm_graph import swarm_graph
    from swarmctl.linter.runner import check_files
    from swarmctl.rulebook import Severity
    from swarmctl.swarm.index import SwarmIndex

    document, found = check_files(*map(Path, files))
    if document is None:
        errors = (one for one in found.diagnostics if one.severity is Severity.ERROR)
        raise ValueError("\n".join(f"{one.span}: {one.message}" for one in errors))
    return swarm_graph(SwarmIndex(document))
