"""The gate as a node, with fakes of ROS 1 and ROS 2: what passes it, and what a host cannot publish."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarmctl.resources import onboard
from tests.onboard.driver.driver_process import Node, running
from tests.onboard.driver.fakes import TESTER
from tests.timing import PATIENCE, wait_for

pytestmark = pytest.mark.usefixtures("ros")

GATE = onboard() / "nodes/gate/gate.py"
PARAMS = {
    "robot": "tb",
    "title": "TurtleBot3 Burger",
    "namespace": "/tb",
    "command_type": "geometry_msgs/Twist",
    "output_type": "geometry_msgs/Twist",
    "command_timeout": 0.5,
    "rate": 10.0,
    "diagnostics_rate": 10.0,
    "commanders": [],
    "motion": {"kind": "differential", "linear_max": 0.22, "angular_max": 2.84, "wheel_separation": 0.16},
    "odom_frame": "tb/odom",
}
START = {"x": 1.0, "y": 2.0, "heading_deg": 90.0}
LOST = "no transform from map to tb/odom: this host lacks tf2_msgs"


TWIST, STAMPED = "geometry_msgs/Twist", "geometry_msgs/TwistStamped"


def passed(node: Node) -> list[dict[str, Any]]:
    """What the gate has sent to the driver."""
    return [one for one in list(node.published) if one["topic"] == "gate/cmd_vel"]


def speeds(node: Node) -> list[float]:
    """Its speeds forward."""
    return [float(one.get("twist", one)["linear"]["x"]) for one in passed(node)]


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

    with running(config, GATE) as node:
        wait_for(lambda: node.latest("/diagnostics"))
        wait_for(lambda: node.command(0.2, sender="/stranger") or "/stranger" in node.status()["message"])
        assert set(speeds(node)) <= {0.0}
        wait_for(lambda: node.command(0.1, sender="/boss") or 0.1 in speeds(node))
        node.process.terminate()
        assert node.process.wait(PATIENCE) == 0
    wait_for(lambda: speeds(node)[-1] == 0.0)
    assert 0.2 not in speeds(node)


@pytest.mark.parametrize("taken", [TWIST, STAMPED])
@pytest.mark.parametrize("sent", [TWIST, STAMPED])
def test_a_gate_takes_one_type_and_sends_another(taken: str, sent: str, tmp_path: Path) -> None:
    config = tmp_path / "gate.yaml"
    types = {"command_type": taken, "output_type": sent}
    config.write_text(yaml.safe_dump({**PARAMS, **types, "commanders": [{**TESTER, "nodes": ["/boss"]}]}))
    with running(config, GATE) as node:
        wait_for(lambda: node.latest("/diagnostics"))

        def command() -> None:
            """Of both types: the gate has subscribed to one."""
            node.command(0.1, sender="/boss", stamp=time.time() if taken == STAMPED else None)
            node.command(0.2, sender="/boss", stamp=time.time() if taken == TWIST else None)

        wait_for(lambda: command() or 0.1 in speeds(node))
        assert set(speeds(node)) == {0.0, 0.1}
        assert {"twist" in one for one in passed(node)} == {sent == STAMPED}
        assert sent == TWIST or all("stamp" in one["header"] for one in passed(node))


@pytest.mark.parametrize(
    ("stamp", "reason"),
    [
        pytest.param(lambda: time.time() - 5, "5.0 s old by its stamp: check the clocks", id="old"),
        pytest.param(lambda: time.time() + 5, "5.0 s ahead of time by its stamp: check", id="ahead"),
        pytest.param(lambda: time.time() - 0.2, "", id="younger than the timeout"),
        pytest.param(lambda: 0.0, "", id="without a time"),
    ],
)
def test_an_old_stamp_is_an_old_command(stamp: Callable[[], float], reason: str, tmp_path: Path) -> None:
    config = tmp_path / "gate.yaml"
    stamped = {"command_type": STAMPED, "commanders": [{**TESTER, "nodes": ["/boss"]}]}
    config.write_text(yaml.safe_dump({**PARAMS, **stamped}))
    with running(config, GATE) as node:
        wait_for(lambda: node.latest("/diagnostics"))

        def command() -> None:
            node.command(0.1, sender="/boss", stamp=stamp())

        wait_for(lambda: command() or (reason in node.status()["message"] if reason else 0.1 in speeds(node)))
        wait_for(lambda: node.values()["commander"] == ("nobody" if reason else "tester (/boss)"))
        assert node.values()["unauthorised senders"] == ""
        assert node.status()["level"] == (1 if reason else 0)
        assert (0.1 in speeds(node)) is not bool(reason)
