"""The page with the picture of a swarm, one HTML file: `graph --format html`, and live what `ui` serves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree.ElementTree import tostring

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from swarmctl.analysis.diagram import Diagram
from swarmctl.resources import templates
from swarmctl.views.graph import svg

_SCRIPTS = ("uplot/uPlot.iife.min.js", "live.js", "motion.js", "arena.js", "connection.js")
_FOLDER = templates() / "page"


@dataclass(frozen=True)
class Live:
    """A page that connects to the server that it comes from, and shows health and motion.

    ``starts``: the declared poses of robots in the map, in m, m and rad; ``control``: with buttons;
    ``taken``: when the only status was taken, as text.
    """

    starts: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    control: bool = False
    taken: str = ""


def graph(diagram: Diagram, live: Live | None = None) -> str:
    """The page."""
    environment = Environment(
        loader=FileSystemLoader(_FOLDER), undefined=StrictUndefined, autoescape=True, trim_blocks=True
    )
    return environment.get_template("page.html.j2").render(
        diagram=diagram.to_json(),
        live=live,
        style=_inline("graph.css", "page.css", *(["uplot/uPlot.min.css"] if live else [])),
        script=_inline("graph.js", *(_SCRIPTS if live else [])),
        picture=tostring(svg.picture(diagram), encoding="unicode"),
    )


def _inline(*names: str) -> str:
    """The contents of shipped files, which hold nothing that ends a script or a style."""
    return "\n".join((_FOLDER / name).read_text("utf-8") for name in names)
