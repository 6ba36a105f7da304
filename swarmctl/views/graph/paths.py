"""Command paths as text: one line per path, hop by hop."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from swarmctl.analysis.command_paths import CommandPath, Hop

_STYLE = {"network": "blue", "master": "dim", "bridge": "dim", "robot": "bold"}


def paths(found: Sequence[CommandPath]) -> Text:
    """One line per path, or the reason why there is none."""
    if not found:
        return Text("`control` names no commander of a robot")
    return Text("\n").join(path(one) for one in found)


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
