"""Parameters of an e-puck's driver for images: transfer time and camera settings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm

GOLDEN = Path(__file__).parent / "golden/epuck-camera"
SPEC = """\
version: 1
name: eyes
mode: leader
leader: pi
hosts: {pi: {address: 192.168.77.12, user: robot, computer: raspberry-pi-3b}}
robots:
  one: {type: epuck-binary, host: pi, settings: {rates: {camera: 0.5}, camera: {width: 20, height: 30}}}
  two: {type: epuck2, host: pi, settings: {rates: {camera: 1}, camera: {encoding: rgb565, zoom: 4}}}
links:
  - {kind: serial, host: pi, robot: one, usb: {serial: EPUCK1}}
  - {kind: serial, host: pi, robot: two, usb: {serial: EPUCK2}}
"""


@pytest.mark.parametrize("robot", ["one", "two"])
def test_golden_of_a_camera_that_is_on(
    robot: str, tmp_path: Path, golden: Callable[[Path, str], None]
) -> None:
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    [params] = [one for one in bundles(swarm)["pi"].files if one.path == f"params/{robot}.yaml"]
    golden(GOLDEN / f"{robot}.yaml", params.content.decode())
