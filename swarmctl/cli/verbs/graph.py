"""``swarmctl graph``: the swarm as a graph, the impact of failures, command paths and load budgets."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, options, selected

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from swarmctl.analysis.command_paths import CommandPath
    from swarmctl.swarm.index import SwarmIndex


class GraphFormat(str, Enum):
    """The values of ``graph --format``."""

    TEXT = "text"
    DOT = "dot"
    MERMAID = "mermaid"
    JSON = "json"


def graph(
    spec: options.Spec,
    overlays: options.Overlays = None,
    format_: Annotated[GraphFormat, typer.Option("--format", help="How to print it.")] = GraphFormat.TEXT,
    impact: Annotated[
        bool, typer.Option("--impact", help="What fails if a host, network, ... fails; the worst first.")
    ] = False,
    paths: Annotated[bool, typer.Option("--paths", help="The path of each command, hop by hop.")] = False,
    path: Annotated[
        tuple[str, str] | None,
        typer.Option("--path", metavar="FROM TO", help="The path of commands from FROM to robot TO."),
    ] = None,
    budgets: Annotated[
        bool, typer.Option("--budgets", help="The load of lines, adapters, boards, hosts and networks.")
    ] = False,
    details: options.Details = False,
    color: options.Color = None,
) -> None:
    """Show a swarm as a graph, or analyse it. The JSON output contains everything (docs/graph.md)."""
    from rich.text import Text

    from swarmctl.swarm.index import SwarmIndex

    index = SwarmIndex(console.read_document(spec))
    if format_ in (GraphFormat.DOT, GraphFormat.MERMAID):
        if impact or paths or path or budgets:
            raise typer.BadParameter(f"--format {format_.value} draws the graph; tables are text or json")
        print(_drawing(index, format_), end="")
    elif format_ is GraphFormat.JSON:
        console.print_json(_everything(index, path))
    else:
        parts = _sections(index, path, impact=impact, paths=paths, budgets=budgets, details=details)
        for number, part in enumerate(parts):
            if number:
                console.out().print()
            if isinstance(part, Text):
                console.show(part)
            else:
                console.out().print(part)


def _drawing(index: SwarmIndex, format_: GraphFormat) -> str:
    from swarmctl.analysis.diagram import diagram
    from swarmctl.views.graph import dot, mermaid

    draw = dot.graph if format_ is GraphFormat.DOT else mermaid.graph
    return draw(diagram(index))


def _sections(
    index: SwarmIndex,
    path: tuple[str, str] | None,
    *,
    impact: bool,
    paths: bool,
    budgets: bool,
    details: bool,
) -> Iterator[RenderableType]:
    """The requested tables; without any, the swarm as a tree."""
    from swarmctl.analysis.budgets import budgets_of
    from swarmctl.analysis.diagram import diagram
    from swarmctl.analysis.impact import impacts
    from swarmctl.views.graph import budgets as budgets_view
    from swarmctl.views.graph import impact as impact_view
    from swarmctl.views.graph import overview
    from swarmctl.views.graph import paths as paths_view

    if impact:
        yield impact_view.table(impacts(index), details=details)
    if paths or path:
        yield paths_view.paths(_paths(index, path), details=details)
    if budgets:
        yield from budgets_view.tables(budgets_of(index), details=details)
    if not (impact or paths or path or budgets):
        yield overview.overview(diagram(index), details=details)


def _everything(index: SwarmIndex, path: tuple[str, str] | None) -> dict[str, object]:
    from swarmctl.analysis.budgets import budgets_of
    from swarmctl.analysis.diagram import diagram
    from swarmctl.analysis.impact import impacts

    return {
        "v": 1,
        **diagram(index).to_json(),
        "impact": [one.to_json() for one in impacts(index)],
        "paths": [one.to_json() for one in _paths(index, path)],
        "budgets": budgets_of(index).to_json(),
    }


def _paths(index: SwarmIndex, path: tuple[str, str] | None) -> tuple[CommandPath, ...]:
    """The path from the commander to the robot in ``path``, else the paths of all commands."""
    from swarmctl.analysis.command_paths import command_path, command_paths
    from swarmctl.swarm.resolve import resolve

    if path is None:
        return command_paths(index)
    swarm = resolve(index.document)
    first, robot = path
    if first not in (*index.spec.programs, *index.spec.hosts, *index.spec.robots):
        first = selected.one(swarm.candidates, first, "hosts", "--path FROM")
    return (command_path(index, first, selected.one(swarm.candidates, robot, "robots", "--path TO")),)
