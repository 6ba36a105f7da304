"""``swarmctl graph``: the swarm as a graph, the impact of failures, command paths and load budgets."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, options, selected

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from rich.console import RenderableType

    from swarmctl.analysis.command_paths import CommandPath
    from swarmctl.analysis.swarm_part import Part
    from swarmctl.swarm.index import SwarmIndex


class GraphFormat(str, Enum):
    """The values of ``graph --format``."""

    TEXT = "text"
    DOT = "dot"
    MERMAID = "mermaid"
    SVG = "svg"
    HTML = "html"
    GRAPHML = "graphml"
    JSON = "json"


def graph(
    spec: options.Spec,
    overlays: options.Overlays = None,
    form: Annotated[
        GraphFormat | None, typer.Option("--format", help="How to print it; by default as text.")
    ] = None,
    json: options.FormatJson = False,
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
    security: Annotated[bool, typer.Option("--security", help="Who may reach what, and why.")] = False,
    limit: options.Limit = None,
    details: options.Details = False,
    color: options.Color = None,
) -> None:
    """Show a swarm as a graph, or analyse it. The JSON output contains everything (docs/graph.md)."""
    from rich.text import Text

    from swarmctl.swarm.index import SwarmIndex

    if path and limit:
        raise typer.BadParameter("--path names both ends, and --limit selects hosts: give one of them")
    chosen = options.format_of(form, json, GraphFormat.TEXT)
    index = SwarmIndex(console.read_document(spec))
    part = _part(index, limit)
    if chosen not in (GraphFormat.TEXT, GraphFormat.JSON):
        if impact or paths or path or budgets or security:
            raise typer.BadParameter(f"--format {chosen.value} has the graph; tables are text or json")
        print(_drawing(index, part, chosen), end="")
    elif chosen is GraphFormat.JSON:
        console.print_json(_everything(index, part, path))
    else:
        tables = {"impact": impact, "paths": paths or path, "budgets": budgets, "security": security}
        chosen_tables = {name for name, wanted in tables.items() if wanted}
        for number, section in enumerate(_sections(index, part, path, chosen_tables, details=details)):
            if number:
                console.out().print()
            if isinstance(section, Text):
                console.show(section)
            else:
                console.out().print(section)


def _part(index: SwarmIndex, limit: list[str] | None) -> Part:
    """The selected hosts with what concerns them; the whole swarm without ``limit``."""
    from swarmctl.analysis.swarm_part import part_of
    from swarmctl.swarm.resolve import resolve

    hosts = selected.hosts(resolve(index.document).candidates, limit) if limit else index.spec.hosts
    return part_of(index, hosts)


def _drawing(index: SwarmIndex, part: Part, form: GraphFormat) -> str:
    from swarmctl.analysis.diagram import diagram
    from swarmctl.analysis.swarm_graph import graphml, swarm_graph
    from swarmctl.views.graph import dot, mermaid, page, svg

    if form is GraphFormat.GRAPHML:
        return graphml(part.graph(swarm_graph(index)))
    views = {
        GraphFormat.DOT: dot.graph,
        GraphFormat.MERMAID: mermaid.graph,
        GraphFormat.SVG: svg.graph,
        GraphFormat.HTML: page.graph,
    }
    return views[form](part.diagram(diagram(index)))


def _sections(
    index: SwarmIndex,
    part: Part,
    path: tuple[str, str] | None,
    chosen: Collection[str],
    *,
    details: bool,
) -> Iterator[RenderableType]:
    """The requested tables; without any, the swarm as a tree."""
    from swarmctl.analysis.budgets import budgets_of
    from swarmctl.analysis.diagram import diagram
    from swarmctl.analysis.impact import impacts
    from swarmctl.swarm.flows import flows_of
    from swarmctl.swarm.resolve import resolve
    from swarmctl.views.graph import analyses as budgets_view
    from swarmctl.views.graph import analyses as flows_view
    from swarmctl.views.graph import analyses as impact_view
    from swarmctl.views.graph import analyses as paths_view
    from swarmctl.views.graph import overview

    if "impact" in chosen:
        yield impact_view.impact_table(part.impacts(impacts(index)), details=details, width=console.columns())
    if "paths" in chosen:
        yield paths_view.paths(_paths(index, part, path), details=details)
    if "budgets" in chosen:
        yield from budgets_view.budget_tables(part.budgets(budgets_of(index)), details=details)
    if "security" in chosen:
        swarm = resolve(index.document)
        yield flows_view.flow_heading(swarm)
        yield flows_view.flow_table(part.flows(flows_of(swarm)))
    if not chosen:
        yield overview.overview(part.diagram(diagram(index)), details=details)


def _everything(index: SwarmIndex, part: Part, path: tuple[str, str] | None) -> dict[str, object]:
    from swarmctl.analysis.budgets import budgets_of
    from swarmctl.analysis.diagram import diagram
    from swarmctl.analysis.impact import impacts
    from swarmctl.swarm.flows import flows_of
    from swarmctl.swarm.resolve import resolve

    return {
        "v": 1,
        **part.diagram(diagram(index)).to_json(),
        "impact": [one.to_json() for one in part.impacts(impacts(index))],
        "paths": [one.to_json() for one in _paths(index, part, path)],
        "budgets": part.budgets(budgets_of(index)).to_json(),
        "flows": [one.to_json() for one in part.flows(flows_of(resolve(index.document)))],
    }


def _paths(index: SwarmIndex, part: Part, path: tuple[str, str] | None) -> tuple[CommandPath, ...]:
    """The path from the commander to the robot in ``path``, else the paths of all commands to the part."""
    from swarmctl.analysis.command_paths import command_path, command_paths
    from swarmctl.swarm.resolve import resolve

    if path is None:
        return part.paths(command_paths(index))
    swarm = resolve(index.document)
    first, robot = path
    if first not in (*index.spec.programs, *index.spec.hosts, *index.spec.robots):
        first = selected.one(swarm.candidates, first, "hosts", "--path FROM")
    return (command_path(index, first, selected.one(swarm.candidates, robot, "robots", "--path TO")),)
