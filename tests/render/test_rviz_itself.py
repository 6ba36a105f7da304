"""RViz itself on the rendered files: every display has its topic, its model and its frames."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm
from tests.onboard.gate.ros_host import run_isolated

pytestmark = [
    pytest.mark.lab,
    pytest.mark.skipif(
        not (shutil.which("rviz") and shutil.which("Xvfb")), reason="RViz is missing: apt install rviz xvfb"
    ),
]
SPEC = """\
version: 1
name: seen
mode: central
hub: pi
hosts:
  pi: {address: 192.168.77.12, user: robot}
  tb: {address: 192.168.77.14, user: robot}
robots:
  made: {type: khepera3, host: pi, start: {x: 1, y: 1}}
  own: {type: khepera3, host: pi, urdf: own.urdf}
  tb: {type: turtlebot3-burger, host: tb, urdf: burger.urdf}
links:
  - {kind: wlan, name: lab, hosts: [pi, tb]}
  - {kind: serial, host: pi, robot: made, usb: {serial: K3}}
  - {kind: serial, host: pi, robot: own, usb: {serial: K4}}
"""
OWN = """\
<robot name="own">
  <link name="base_link"><visual><geometry><box size="0.1 0.1 0.1" /></geometry></visual></link>
  <link name="wheel"><visual><geometry><sphere radius="0.03" /></geometry></visual></link>
  <joint name="left_wheel" type="continuous"><parent link="base_link" /><child link="wheel" /></joint>
</robot>
"""
BURGER = """\
<robot name="burger">
  <link name="base_footprint" />
  <link name="base_link"><visual><geometry><box size="0.1 0.1 0.1" /></geometry></visual></link>
  <joint name="base" type="fixed"><parent link="base_footprint" /><child link="base_link" /></joint>
</robot>
"""
BASES = {"made": "base_link", "own": "base_link", "tb": "base_footprint"}


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What `rviz_session.py` prints about the release of the master's host."""
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    folder = tmp_path_factory.mktemp("seen")
    (folder / "own.urdf").write_text(OWN)
    (folder / "burger.urdf").write_text(BURGER)
    (folder / "swarm.yaml").write_text(SPEC)
    swarm, found = load_swarm(folder / "swarm.yaml")
    assert swarm is not None, found
    release = folder / "release"
    for bundle in bundles(swarm).values():
        for file in bundle.files:
            if file.path.startswith(("urdf/", "rviz/", "launch/view")):
                (release / file.path).parent.mkdir(parents=True, exist_ok=True)
                (release / file.path).write_bytes(file.content)
    robots = [
        {
            "namespace": one.namespace,
            "urdf": f"/release/urdf/{name}.urdf",
            "odom_frame": one.odom_frame,
            "base": f"{one.frame_prefix}/{BASES[name]}",
            "joints": [] if name == "tb" else ["left_wheel", "right_wheel"],
            "scan": "scan" if name == "tb" else "proximity/scan",
        }
        for name, one in swarm.robots.items()
    ]
    return run_isolated(
        Path(__file__).parent / "rviz_session.py", image.ensure(print), release, json.dumps(robots)
    )


def test_rviz_shows_every_robot_without_an_error(seen: Any) -> None:
    assert seen["right"]["red"] == 0
    assert seen["right"]["log"] == []
    assert {"/made/odom", "/own/proximity/scan", "/tb/odom", "/tb/scan"} <= set(seen["right"]["topics"])


def test_what_rviz_cannot_show_is_red_here(seen: Any) -> None:
    """Otherwise the test above would see nothing."""
    assert seen["wrong"]["red"] == 2
