"""The graph of robots that need no line: they stand below the host that drives them."""

from __future__ import annotations

from pathlib import Path

from swarmctl.analysis.diagram import diagram
from swarmctl.spec.load import load
from swarmctl.swarm.index import SwarmIndex
from swarmctl.views.graph.overview import overview

SPEC = """
version: 1
name: lab
mode: central
hub: tb3-01
hosts: {tb3-01: {address: 192.168.77.21}}
robots: {tb3-01: {type: turtlebot3-burger, host: tb3-01}}
"""


def test_a_robot_without_a_line_is_shown_below_its_host(tmp_path: Path) -> None:
    (tmp_path / "swarm.yaml").write_text(SPEC, "utf-8")
    document, found = load([tmp_path / "swarm.yaml"])
    assert document is not None, found
    lines = str(overview(diagram(SwarmIndex(document)))).splitlines()
    assert "    robot tb3-01  turtlebot3-burger" in lines
