"""Command paths as text: one line per path, hop by hop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rich.text import Text

from swarmctl.analysis.command_paths import CommandPath, Hop
from swarmctl.views.equal_hosts import FEW, grouped
from swarmctl.views.graph.impact import NUMBER
from swarmctl.yamltext import hostlist

_STYLE = {"network": "blue", "master": "dim", "bridge": "dim", "robot": "bold"}


def paths(found: Sequence[CommandPath], *, details: bool = False) -> Text:
    """One line per path, or the reason why there is none.

    Paths that differ only in numbers of names share a line below a summary, unless with ``details``.
    """
    if not found:
        return Text("`control` names no commander of a robot")
    groups = grouped(found, _pattern, alone=lambda group: details or len(group) <= FEW)
    lines = [_together(group) for group in groups]
    if len(lines) < len(found):
        lines.insert(0, Text(f"{len(found)} paths, equal ones as one line (--details: each of them)"))
    return Text("\n").join(lines)


def _pattern(one: CommandPath) -> tuple[object, ...]:
    """Equal for paths that differ only in numbers of names."""
    hops = tuple((hop.kind, *(NUMBER.sub("#", text) for text in (hop.name, hop.detail))) for hop in one.hops)
    return one.by, NUMBER.sub("#", one.robot), NUMBER.sub("#", one.why), hops


def _together(group: Sequence[CommandPath]) -> Text:
    """Equal paths as one, in which each hop has the names of all."""
    first = group[0]
    hops = tuple(
        Hop(
            same[0].kind,
            hostlist.written(hop.name for hop in same),
            hostlist.written(hop.detail for hop in same),
        )
        for same in zip(*(one.hops for one in group), strict=True)
    )
    return path(replace(first, robot=hostlist.written(one.robot for one in group), hops=hops))


def path(found: CommandPath) -> Text:
    """One path, or why there is none."""
    if found.why:
        return Text.assemble(f"{found.by} to {found.robot}: ", ("no path", "bold red"), f": {found.why}")
    line = Text()
    for number, hop in enumerate(found.hops):
        line.append(" -> " if number else "").append(_hop(hop), _STYLE.get(hop.kind, ""))
    return line


def _hop(hop: Hop) -> str:
    detail = f" ({hop.detail})" if hop.detail else ""
    return f"{hop.kind} {hop.name}{detail}"
