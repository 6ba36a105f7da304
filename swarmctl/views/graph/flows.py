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
    filtered = [island.name for island in swarm.islands if island.filtered]
    others = [island.name for island in swarm.islands if not island.filtered]
    if not filtered:
        return Text("security: off. Everybody may reach everything; this is what the swarm needs:")
    beside = f"; off in {hostlist.written(others)}" if others else ""
    level = "sealed" if swarm.overlay else "filtered"
    return Text(f"security: {level} in {hostlist.written(filtered)}{beside}")


def table(flows: Sequence[Flow]) -> Table:
    """One row for each flow."""
    made = Table(box=None, show_edge=False, pad_edge=False)
    for title in ("from", "may reach", "on", "because"):
        made.add_column(title, overflow="fold")
    for flow in flows:
        hosts = _EACH_OTHER if flow.hosts == flow.sources else hostlist.written(flow.hosts)
        made.add_row(hostlist.written(flow.sources) or _ANYONE, flow.service.value, hosts, flow.cause)
    return made
