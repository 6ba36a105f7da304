"""The gate as a node, with fakes of ROS 1 and ROS 2: what passes it, and what a host cannot publish."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from swarmctl.resources import onboard
from tests.onboard.driver.driver_process import running
from tests.onboard.driver.fakes import TESTER
from tests.timing import PATIENCE, wait_for

pytestmark = pytest.mark.usefixtures("ros")

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
        wait_for(lambda: node.status()["level"] == level)
        assert node.values().get("left out") == (LOST if level else None)
        assert node.status()["message"].endswith(LOST) == bool(level)
        assert (node.latest("/tf_static") is not None) == (bool(start) and not lacks)


def test_a_commander_passes_it_and_a_stranger_does_not(tmp_path: Path) -> None:
    commander = {**TESTER, "name": "boss", "nodes": ["/boss"]}
    config = tmp_path / "gate.yaml"
    config.write_text(yaml.safe_dump({**PARAMS, "commanders": [commander]}))

    def speeds() -> list[float]:
        return [one["linear"]["x"] for one in list(node.published) if one["topic"] == "gate/cmd_vel"]

    with running(config, GATE) as node:
        wait_for(lambda: node.latest("/diagnostics"))
        wait_for(lambda: node.command(0.2, sender="/stranger") or "/stranger" in node.status()["message"])
        assert set(speeds()) <= {0.0}
        wait_for(lambda: node.command(0.1, sender="/boss") or 0.1 in speeds())
        node.process.terminate()
        assert node.process.wait(PATIENCE) == 0
    wait_for(lambda: speeds()[-1] == 0.0)
    assert 0.2 not in speeds()
