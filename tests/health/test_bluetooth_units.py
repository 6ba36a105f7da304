"""The units of Bluetooth robots in ``status``: what is the same for each robot of a host stands once."""

from __future__ import annotations

from pathlib import Path

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import Release, expected_graph
from swarmctl.health.swarm_health import status
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.resolve import resolve
from swarmctl.views import status as view
from tests.health.swarm_values import NO_ADAPTER, all_well
from tests.swarm.documents import read

SPEC = """
version: 1
name: pucks
mode: central
hub: pi
hosts: {pi: {address: 10.9.0.1, user: robot}}
robots: {"ep-[1-6]": {type: epuck2, host: pi}}
links:
  - kind: bluetooth
    host: pi
    robot: ep-[1-6]
    mac: "10:00:e8:c5:64:0[1-6]"
    pin: {secret: epuck-pin}
"""


def test_units_that_are_skipped_for_one_reason_stand_once(tmp_path: Path) -> None:
    swarm = resolve(read(tmp_path, SPEC))
    units = tuple(unit.name for unit in bundles(swarm)["pi"].units)
    graph = expected_graph(swarm, {"pi": Release("a" * 16, units)})
    answers = all_well(graph)
    bluetooth = [name for name in units if name.endswith((".pair.service", ".rfcomm.service"))]
    assert len(bluetooth) == 12
    seen = answers["pi"].units
    without = {name: seen[name]._replace(**NO_ADAPTER) for name in bluetooth}
    answers["pi"] = answers["pi"]._replace(units={**seen, **without})
    text = view.status(status(graph, answers, diagnose(graph, answers))).plain
    pairing, line = (f"unit swarm-pucks.ep-[1-6].{what}.service on pi" for what in ("pair", "rfcomm"))
    assert [line for line in text.splitlines() if line.startswith("- ")] == [
        f"- skipped: {pairing}, {line}; --details shows why"
    ]
