"""The gate's node with a fake ROS: what it reports of a host that cannot publish the robot's start."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from swarmctl.resources import onboard
from tests.onboard.driver.driver_process import running
from tests.timing import wait_for

GATE = onboard() / "nodes/gate/gate.py"
PARAMS = {
    "robot": "tb",
    "title": "TurtleBot3 Burger",
    "namespace": "/tb",
    "command_type": "geometry_msgs/Twist",
    "command_timeout": 0.5,
    "rate": 10.0,
    "diagnostics_rate": 10.0,
    "commanders": [],
    "motion": {"kind": "differential", "linear_max": 0.22, "angular_max": 2.84, "wheel_separation": 0.16},
    "odom_frame": "tb/odom",
}
START = {"x": 1.0, "y": 2.0, "heading_deg": 90.0}
LOST = "no transform from map to tb/odom: this host lacks tf2_msgs"


@pytest.mark.parametrize(
    ("start", "lacks", "level"), [(START, "tf2_msgs", 1), ({}, "tf2_msgs", 0), (START, "", 0)]
)
def test_a_start_that_cannot_be_published_is_a_warning(
    start: dict[str, float], lacks: str, level: int, tmp_path: Path
) -> None:
    config = tmp_path / "gate.yaml"
    config.write_text(yaml.safe_dump({**PARAMS, **({"start": start} if start else {})}))
    with running(config, GATE, FAKE_LACKS=lacks) as node:
        wait_for(lambda: node.latest("/diagnostics"))
        assert node.status()["level"] == level
        assert node.values().get("left out") == (LOST if level else None)
        assert node.status()["message"].endswith(LOST) == bool(level)
        assert (node.latest("/tf_static") is not None) == (bool(start) and not lacks)
