"""Status knows the nodes that launch files beside the spec start, also of a unit that is only starting."""

from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.observations import ConflictSeen
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import Release, expected_graph
from swarmctl.health.verdict import State
from swarmctl.linter.launch_uses import launch_uses, nodes_of
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolve import resolve
from tests.health.swarm_values import RUNNING
from tests.loading import load_checked
from tests.ros_packages.packages import manifest

SPEC = """\
version: 1
name: new
mode: central
hub: leader
hosts:
  leader: {address: 192.0.2.1}
  k3: {address: 192.0.2.2}
  epuck: {address: 192.0.2.3}
robots:
  koala: {type: koala, host: leader}
links:
  - {kind: wlan, name: lab, hosts: [leader, k3, epuck]}
  - {kind: serial, host: leader, robot: koala, usb: {serial: A600dXyz}}
control:
  - {by: leader, of: [koala]}
programs:
  left: {host: k3, package: talking, launch: eyes.launch}
  right: {host: epuck, package: talking, launch: eyes.launch}
ignore: [{rule: PKG008, reason: the test looks at what happens then}]
"""
EYES = '<launch><node pkg="speech" type="say" name="eyes"/></launch>'


@pytest.mark.parametrize(("active", "state"), [("active", State.BAD), ("inactive", State.WARNING)])
def test_a_node_of_a_unit_that_is_only_starting_has_its_name(
    active: str, state: State, tmp_path: Path
) -> None:
    """The probe of one host saw its node end, that of the other found no node yet."""
    (tmp_path / "talking/launch").mkdir(parents=True)
    (tmp_path / "talking/package.xml").write_text(manifest("talking"))
    (tmp_path / "talking/launch/eyes.launch").write_text(EYES)
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC)
    found, diagnostics = load_checked(spec)
    assert found is not None, diagnostics
    left, right = "swarm-new.left.service", "swarm-new.right.service"
    units = {"leader": (), "k3": (left,), "epuck": (right,)}
    graph = expected_graph(resolve(found), {name: Release("a", own) for name, own in units.items()})
    answers = {name: Answer(release="a") for name in units}
    answers["k3"] = answers["k3"]._replace(units={left: RUNNING._replace(active=active)})
    kicked = {right: {"/eyes": ConflictSeen(1, 2.0)}}
    answers["epuck"] = answers["epuck"]._replace(units={right: RUNNING}, conflicts=kicked)
    seen = diagnose(graph, answers, nodes_of(launch_uses(SwarmIndex(found)))).findings
    (name,) = (one for one in seen if one.check == "node name")
    assert name.state is state
    assert ("two nodes are called /eyes, on hosts k3 and epuck" in name.message) == (state is State.BAD)
