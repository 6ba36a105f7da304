"""``swarmctl graph``: the swarm drawn, what dies if something dies, how orders travel, what links bear."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import access, console

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from swarmctl.spec.load import Document
    from swarmctl.topology.paths import Way


class GraphFormat(str, Enum):
    TEXT = "text"
    DOT = "dot"
    MERMAID = "mermaid"
    JSON = "json"


def graph(
    spec: access.Spec,
    overlays: access.Overlays = None,
    format_: Annotated[GraphFormat, typer.Option("--format", help="How to print it.")] = GraphFormat.TEXT,
    impact: Annotated[
        bool, typer.Option("--impact", help="What dies if each host, network, ... dies; the worst first.")
    ] = False,
    paths: Annotated[bool, typer.Option("--paths", help="How each order travels, hop by hop.")] = False,
    path: Annotated[
        tuple[str, str] | None,
        typer.Option("--path", metavar="FROM TO", help="How orders of FROM travel to robot TO."),
    ] = None,
    budgets: Annotated[
        bool, typer.Option("--budgets", help="What lines, adapters, boards, hosts and networks bear.")
    ] = False,
    color: access.Color = None,
) -> None:
    """Show a swarm as a graph, or what the graph says. JSON holds everything at once (docs/graph.md)."""
    document = console.read_document(spec)
    if format_ in (GraphFormat.DOT, GraphFormat.MERMAID):
        if impact or paths or path or budgets:
            raise typer.BadParameter(f"--format {format_.value} draws the graph; tables are text or json")
        print(_drawing(document, format_), end="")
    elif format_ is GraphFormat.JSON:
        console.print_json(_everything(document, path))
    else:
        parts = _sections(document, path, impact=impact, paths=paths, budgets=budgets)
        for number, part in enumerate(parts):
            console.out().print(*([""] if number else []), part, sep="\n")


def _drawing(document: Document, format_: GraphFormat) -> str:
    from swarmctl.topology.picture import picture
    from swarmctl.views.graph import dot, mermaid

    draw = dot.graph if format_ is GraphFormat.DOT else mermaid.graph
    return draw(picture(document.spec, document.types))


def _sections(
    document: Document, path: tuple[str, str] | None, *, impact: bool, paths: bool, budgets: bool
) -> Iterator[RenderableType]:
    """The tables that were asked for; without any, the swarm as a tree."""
    from swarmctl.topology.budgets import budgets_of
    from swarmctl.topology.impact import impacts
    from swarmctl.topology.picture import picture
    from swarmctl.views.graph import budgets as budgets_view
    from swarmctl.views.graph import impact as impact_view
    from swarmctl.views.graph import overview
    from swarmctl.views.graph import paths as paths_view

    if impact:
        yield impact_view.table(impacts(document.spec))
    if paths or path:
        yield paths_view.paths(_ways(document, path))
    if budgets:
        yield from budgets_view.tables(budgets_of(document))
    if not (impact or paths or path or budgets):
        yield overview.overview(picture(document.spec, document.types))


def _everything(document: Document, path: tuple[str, str] | None) -> dict[str, object]:
    from swarmctl.topology.budgets import budgets_of
    from swarmctl.topology.impact import impacts
    from swarmctl.topology.picture import picture

    return {
        "v": 1,
        **picture(document.spec, document.types).to_json(),
        "impact": [one.to_json() for one in impacts(document.spec)],
        "paths": [one.to_json() for one in _ways(document, path)],
        "budgets": budgets_of(document).to_json(),
    }


def _ways(document: Document, path: tuple[str, str] | None) -> tuple[Way, ...]:
    """The way that was asked for, else that of every order."""
    from swarmctl.spec.suggest import did_you_mean
    from swarmctl.topology.paths import way, ways
    from swarmctl.topology.wiring import Wiring

    spec = document.spec
    if path is None:
        return ways(Wiring(spec))
    commanders = (*spec.programs, *spec.hosts, *spec.robots)
    asked = ((path[0], commanders, "program, host or robot"), (path[1], tuple(spec.robots), "robot"))
    for name, known, what in asked:
        if name not in known:
            found = did_you_mean(name, known, "known names")
            console.fail(f"--path: there is no {what} called `{name}`", *found)
    return (way(Wiring(spec), *path),)
