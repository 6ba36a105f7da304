"""An attack is judged by what is true of the swarm, whatever the attacker was answered."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tests.attacks.attacks import JUDGES, Scene
from tests.attacks.intruder import ELSEWHERE
from tests.attacks.table import Verdict
from tests.attacks.world import World

BEFORE = World(
    {
        "pid": 7,
        "publishers": [["/k3/odom", "/k3/driver"], ["/k3/cmd_vel", "/rostopic_1"]],
        "subscribers": [],
        "driver": "http://192.168.77.11:1/",
        "parameters": ["a run", {}],
        "commanders": [["/rostopic_1", "http://192.168.77.10:2/"]],
        "squatted": "http://192.168.77.10:3/",
    },
    {"k3-pi:k3": 5},
    {"distance": 1.0, "lights": {"led0": 0}},
)
CALM = Scene(BEFORE, BEFORE, {})


def changed(robot: dict[str, Any] | None = None, unit: int = 5, **graph: Any) -> Scene:
    return replace(
        CALM, after=World({**BEFORE.graph, **graph}, {"k3-pi:k3": unit}, {**BEFORE.robot, **(robot or {})})
    )


@pytest.mark.parametrize("call", JUDGES)
def test_what_changes_nothing_is_refused(call: str) -> None:
    assert JUDGES[call](CALM) is Verdict.REFUSED


@pytest.mark.parametrize(
    ("call", "scene"),
    [
        ("list_graph", replace(CALM, printed={"read": [["/k3/odom", ["/k3/driver"]]]})),
        ("read_odometry", replace(CALM, printed={"read": [1.0, 0.0]}, place=(1.0, 0.0))),
        ("forged_update", changed({"distance": 1.1})),
        ("squat_driver", replace(CALM, printed={"read": ELSEWHERE})),
        ("set_lights", changed({"lights": {"led0": 1}})),
        ("kick_out", changed(unit=6)),
        ("shut_down_driver", replace(CALM, stood=True, obeys=False)),
        ("shut_down_master", changed(pid=8)),
        ("unregister_odometry", changed(publishers=[])),
        ("set_run_id", changed(parameters=["intruder", {}])),
        ("flood_master", replace(CALM, master_answered=False)),
        ("flood_driver", replace(CALM, late=True)),
        ("log_in", replace(CALM, logged_in=True)),
        ("tamper", replace(CALM, files_changed=True)),
        ("hold_lock", replace(CALM, lock_was_free=False)),
    ],
)
def test_what_does_what_it_is_for_succeeds(call: str, scene: Scene) -> None:
    assert JUDGES[call](scene) is Verdict.SUCCEEDS


@pytest.mark.parametrize(
    ("call", "scene"),
    [
        ("kick_out", changed(driver="http://192.168.77.12:9/")),
        ("dead_publishers", changed(publishers=[["/k3/cmd_vel", "/intruder0"]])),
        ("flood_driver", replace(CALM, stood=True)),
        ("unregister_commander", changed(commanders=[])),
    ],
)
def test_a_robot_that_obeys_its_commander_all_the_same_is_partly(call: str, scene: Scene) -> None:
    assert JUDGES[call](scene) is Verdict.PARTLY


def test_a_place_that_is_not_the_robots_is_not_read() -> None:
    assert (
        JUDGES["read_odometry"](replace(CALM, printed={"read": [3.0, 0.0]}, place=(1.0, 0.0)))
        is Verdict.REFUSED
    )
