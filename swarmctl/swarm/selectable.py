"""What selections on a command line can name: that of the spec, each robot and program with its host."""

from __future__ import annotations

from dataclasses import replace

from swarmctl.spec.selection_candidates import Candidates
from swarmctl.spec.selection_expansion import candidates_in
from swarmctl.swarm.index import SwarmIndex


def candidates_of(index: SwarmIndex) -> Candidates:
    """Returns what can be selected in a document without errors."""
    found = candidates_in(index.document.source.root)
    return replace(
        found,
        robots={name: replace(one, host=index.driving[name]) for name, one in found.robots.items()},
        programs={name: replace(one, host=index.program_hosts[name]) for name, one in found.programs.items()},
    )
