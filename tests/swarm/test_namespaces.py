"""`namespace` of robots: all that is named after a robot follows it, and nothing else changes."""

from __future__ import annotations

import re
from pathlib import Path

from swarmctl.analysis.diagram import diagram
from swarmctl.analysis.network_load import network_budgets
from swarmctl.health.expected_graph import Release, bridges_of, expected_graph
from swarmctl.render.build_bundle import bundles
from swarmctl.swarm.index import SwarmIndex
from tests.loading import load_checked, load_swarm

SPEC = """
version: 1
name: lab
mode: standalone
ros: {naming: address}
hosts:
  base: {address: 192.168.77.10, computer: laptop}
  k3-pi: {address: 192.168.77.11, computer: raspberry-pi-3b}
  tb-pi: {address: 192.168.77.12, computer: raspberry-pi-3b}
robots:
  koala: {type: koala, host: base, KOALA}
  k3: {type: khepera3, host: k3-pi, K3}
  tb-1: {type: turtlebot3-burger, host: tb-pi, TB1}
links:
  - {kind: wlan, name: wifi, hosts: [base, k3-pi, tb-pi], multicast: true}
  - {kind: serial, host: base, robot: koala, usb: {serial: A600dXyz}}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
programs:
  pad: {host: base, use: teleop-joy, params: {device: /dev/input/js0}}
  arm: {robot: k3, package: arm, executable: arm.py, publishes: [{topic: reach, type: std_msgs/Float32}]}
  look:
    host: base
    package: look
    executable: look.py
    subscribes:
      - {topic: /SPACE/k3/odom, type: nav_msgs/Odometry}
      - {topic: /SPACE/k3/proximity/scan, type: sensor_msgs/LaserScan}
      - {topic: /SPACE/k3/reach, type: std_msgs/Float32}
      - {topic: /SPACE/tb_1/odom, type: nav_msgs/Odometry}
control:
  - {by: pad, of: [koala, k3, tb-1]}
  - {by: koala, of: [k3], priority: 1}
time: {root: base}
"""
ROBOTS = {"KOALA": "koala", "K3": "k3", "TB1": "tb_1"}


def spec_with(folder: Path, space: str) -> Path:
    """Writes the spec with all robots below the namespace ``space``, or as they are without one."""
    text = SPEC.replace("/SPACE", space and f"/{space}")
    for mark, name in ROBOTS.items():
        text = text.replace(f", {mark}", f", namespace: {space}/{name}" if space else "")
    folder.mkdir()
    path = folder / "swarm.yaml"
    path.write_text(text, "utf-8")
    return path


def everything(path: Path) -> str:
    """Returns what is rendered, expected and computed for a spec, as one text without digests and spaces."""
    swarm, findings = load_swarm(path)
    assert swarm is not None, [one.message for one in findings]
    made = bundles(swarm)
    files = [
        (host, file.path, file.content.decode(errors="replace"))
        for host, bundle in made.items()
        for file in bundle.files
        if not file.path.endswith(".py")
    ]
    document, _ = load_checked(path)
    index = SwarmIndex(document)
    graph = expected_graph(swarm, {host: Release("a" * 16, ()) for host in made})
    shown = [files, graph, bridges_of(swarm), list(network_budgets(index)), diagram(index)]
    return re.sub(r"\b[0-9a-f]{16,64}\b", "DIGEST", re.sub(r"(\\n|\s)+", "", repr(shown)))


def test_all_that_is_named_after_a_robot_follows(tmp_path: Path) -> None:
    """The same spec with and without a namespace around the robots differs in nothing but these."""
    plain = everything(spec_with(tmp_path / "plain", ""))
    nested = everything(spec_with(tmp_path / "nested", "west/lab"))
    assert "west/lab/k3" in nested
    assert nested.replace("west/lab/", "") == plain
