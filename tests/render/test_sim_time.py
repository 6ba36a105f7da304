"""`use_sim_time`: the unit of the master sets the parameter, and every node waits for it."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from tests import ROOT
from tests.loading import load_swarm

EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"
CLOCK = """
ros: {use_sim_time: %s}
programs:
  replay:
    host: koala-laptop
    command: [rosbag, play, --clock, /home/robot/run.bag]
    publishes: [{topic: /clock, type: rosgraph_msgs/Clock}]
"""


@pytest.mark.parametrize("used", [True, False])
def test_the_master_sets_the_parameter_before_nodes(used: bool, tmp_path: Path) -> None:
    overlay = tmp_path / "clock.yaml"
    overlay.write_text(CLOCK % str(used).lower())
    swarm, found = load_swarm(EXAMPLE, overlay)
    assert swarm is not None, found
    unit = next(one for one in bundles(swarm)["koala-laptop"].files if one.path.endswith(".master.service"))
    (line,) = (one for one in unit.content.decode().splitlines() if one.startswith("ExecStartPost="))
    words = shlex.split(line)
    assert words[-2:] == ["--within", "30"]
    assert ("--use-sim-time" in words) is used
    for bundle in bundles(swarm).values():
        (environment,) = (one for one in bundle.files if one.path == "env/ros.env")
        assert ("SWARM_USE_SIM_TIME=1" in environment.content.decode().splitlines()) is used
