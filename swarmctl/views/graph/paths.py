"""How orders travel: each path on a line, hop by hop."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from swarmctl.topology.paths import Hop, Way

_STYLE = {"network": "blue", "master": "dim", "bridge": "dim", "robot": "bold"}


def paths(ways: Sequence[Way]) -> Text:
    """One line a path, or why there is none."""
    if not ways:
        return Text("`control` names nobody who commands a robot")
    return Text("\n").join(path(way) for way in ways)


def path(way: Way) -> Text:
    if way.why:
        return Text.assemble(f"{way.by} to {way.robot}: ", ("no way", "bold red"), f": {way.why}")
    line = Text()
    for number, hop in enumerate(way.hops):
        line.append(" -> " if number else "").append(_hop(hop), _STYLE.get(hop.kind, ""))
    return line


def _hop(hop: Hop) -> str:
    detail = f" ({hop.detail})" if hop.detail else ""
    return f"{hop.kind} {hop.name}{detail}"
