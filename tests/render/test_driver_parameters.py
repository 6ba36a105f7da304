"""The ROS parameters that a driver sets are those that ``status`` looks for."""

from __future__ import annotations

import yaml
from swarm_onboard.driver.live_values import shown_params

from swarmctl.render.build_bundle import bundles
from swarmctl.render.driver_config import params_path, set_parameters
from swarmctl.swarm.resolved import SwarmctlDriver
from tests import ROOT
from tests.loading import load_swarm


def test_what_a_driver_sets_is_what_its_file_has() -> None:
    swarm, _ = load_swarm(ROOT / "examples/paper-5-combined/swarm.yaml")
    assert swarm is not None
    compared = []
    for host, bundle in bundles(swarm).items():
        files = {file.path: file.content for file in bundle.files}
        for robot in swarm.robots_on(host):
            if isinstance(robot.driver, SwarmctlDriver):
                data = yaml.safe_load(files[params_path(robot)])
                assert set_parameters(robot, robot.driver) == shown_params(data)
                compared.append(robot.type_name)
    assert len(set(compared)) > 2
