"""The page with the picture of a swarm, one HTML file: `graph --format html`, and live what `ui` serves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import tostring

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from swarmctl.analysis.diagram import Diagram
from swarmctl.resources import templates
from swarmctl.views.graph import svg

_SCRIPTS = ("uplot/uPlot.iife.min.js", "live.js", "motion.js", "arena.js")
_FOLDER = templates() / "page"


@dataclass(frozen=True)
class Live:
    """A page that connects to the server that it comes from, and shows health and motion.

    ``starts``: the declared poses of robots in the map, in m, m and rad; ``control``: with buttons;
    ``taken``: when the only status was taken, as text; ``run``: a recorded one to replay, rows by robot.
    """

    starts: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    control: bool = False
    taken: str = ""
    run: Mapping[str, Sequence[Any]] | None = None

    @property
    def connected(self) -> bool:
        """False for a recorded run without a status: the server has nothing to send."""
        return self.run is None or bool(self.taken)

    @property
    def scripts(self) -> Iterator[str]:
        """The names of its scripts."""
        yield from _SCRIPTS
        if self.connected:
            yield "connection.js"
        if self.run is not None:
            yield "replay.js"


def graph(diagram: Diagram, live: Live | None = None) -> str:
    """The page."""
    environment = Environment(
        loader=FileSystemLoader(_FOLDER), undefined=StrictUndefined, autoescape=True, trim_blocks=True
    )
    return environment.get_template("page.html.j2").render(
        diagram=diagram.to_json(),
        live=live,
        style=_inline("graph.css", "page.css", *(["uplot/uPlot.min.css"] if live else [])),
        script=_inline("graph.js", *(live.scripts if live else [])),
        picture=tostring(svg.picture(diagram), encoding="unicode"),
    )


def _inline(*names: str) -> str:
    """The contents of shipped files, which hold nothing that ends a script or a style."""
    return "\n".join((_FOLDER / name).read_text("utf-8") for name in names)
