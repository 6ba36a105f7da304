"""Who may reach what in a swarm, and why, as text."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from swarmctl.swarm.flow import Flow
from swarmctl.swarm.resolved import Swarm
from swarmctl.yamltext import hostlist

_ANYONE, _EACH_OTHER = "everybody", "each other"


def heading(swarm: Swarm) -> Text:
    """Which islands drop everything else."""
    by_level: dict[str, list[str]] = {}
    for island in sorted(swarm.islands, key=lambda one: not one.filtered):
        level = swarm.security if swarm.overlay and island.filtered else island.security
        by_level.setdefault(level, []).append(island.name)
    if not any(island.filtered for island in swarm.islands):
        levels = ", ".join(by_level)
        return Text(f"security: {levels}. Everybody may reach everything; this is what the swarm needs:")
    return Text("security: " + "; ".join(f"{one} in {hostlist.written(by_level[one])}" for one in by_level))


def table(flows: Sequence[Flow]) -> Table:
    """One row for each flow."""
    made = Table(box=None, show_edge=False, pad_edge=False)
    for title in ("from", "may reach", "on", "because"):
        made.add_column(title, overflow="fold")
    for flow in flows:
        hosts = _EACH_OTHER if flow.hosts == flow.sources else hostlist.written(flow.hosts)
        made.add_row(hostlist.written(flow.sources) or _ANYONE, flow.service.value, hosts, flow.cause)
    return made
