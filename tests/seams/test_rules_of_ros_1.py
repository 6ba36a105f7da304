"""Rules about ROS 1 hold for ROS 1: a spec of another middleware gets none of their findings."""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.console import Console

from swarmctl.analysis.command_paths import command_paths
from swarmctl.analysis.diagram import diagram
from swarmctl.analysis.impact import impacts
from swarmctl.linter.context import RuleContext
from swarmctl.linter.runner import RULES, lint
from swarmctl.spec.load import Document, load
from swarmctl.views.graph.overview import overview

LEADER = """\
version: 1
name: newswarm
mode: leader
leader: big
ros: {distro: DISTRO}
hosts:
  big: {address: 8.8.8.8, optional: true}
  pi: {address: 192.168.77.11}
robots: {k3: {type: khepera3, host: pi}}
links:
  - {kind: ethernet, name: lab, hosts: [big, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
control: [{by: map, of: [k3]}]
programs:
  rosout: {host: big, package: logs, executable: keep}
  map:
    host: big
    package: map_server
    executable: map_server
    environment: {ROS_MASTER_URI: "http://big:11311", HERE: "$(pwd)"}
    params: {use_sim_time: true}
    publishes:
      - {topic: /rosout, type: rcl_interfaces/Log}
      - {topic: /parameter_events, type: rcl_interfaces/ParameterEvent}
"""
OF_ROS_1 = {"PROG008", "PROG009", "PROG016", "NAME005", "SEC004", "MODE016", "TOPIC001"}


def document(tmp_path: Path, distro: str) -> Document:
    spec = tmp_path / "leader.yaml"
    spec.write_text(LEADER.replace("DISTRO", distro), "utf-8")
    found, diagnostics = load([spec])
    assert found is not None, diagnostics
    return found


def codes(tmp_path: Path, distro: str) -> set[str]:
    return {one.code for one in lint(document(tmp_path, distro))}


@pytest.mark.usefixtures("registered")
def test_rules_about_ros_1_are_silent_for_another_middleware(tmp_path: Path) -> None:
    assert codes(tmp_path, "noetic") >= OF_ROS_1
    assert codes(tmp_path, "pebble") & OF_ROS_1 == set()
    assert {one for rule in RULES if rule.needs == "master" for one in rule.ids} >= {"NAME004", "PKG008"}


@pytest.mark.usefixtures("registered")
def test_standard_topics_are_those_of_the_middleware(tmp_path: Path) -> None:
    text = LEADER.replace("DISTRO", "pebble").replace("rcl_interfaces/ParameterEvent", "std_msgs/String")
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    found, _ = load([tmp_path / "swarm.yaml"])
    assert found is not None
    [clash] = [one for one in lint(found) if one.code == "TOPIC001"]
    assert "`/parameter_events` has type std_msgs/String" in clash.message
    assert "rostopic" not in clash.help[0]


@pytest.mark.usefixtures("registered")
def test_the_graph_has_no_master(tmp_path: Path) -> None:
    texts = {}
    for distro in ("noetic", "pebble"):
        context = RuleContext(document(tmp_path, distro))
        console = Console(width=200, no_color=True)
        with console.capture() as capture:
            console.print(overview(diagram(context)))
        hops = [hop.kind for path in command_paths(context) for hop in path.hops]
        lost = {name for one in impacts(context) for name in one.masters}
        texts[distro] = ("master" in capture.get(), "master" in hops, bool(lost))
    assert texts == {"noetic": (True, True, True), "pebble": (False, False, False)}
