"""What ``lab up`` says about the robots of a fleet."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.lab import lab
from swarmctl.lab.emulators.emulator_lookup import user_emulators
from swarmctl.lab.lab import robot_lines
from swarmctl.lab.lab_plan import plan_of
from swarmctl.lab.lab_state import State
from swarmctl.spec.load import load
from swarmctl.swarm.resolve import resolve
from tests import ROOT

FLEET = ROOT / "examples/lab-fleet/swarm.yaml"


def test_a_running_lab_names_its_stand_ins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document, _ = load([FLEET])
    assert document is not None
    plan = plan_of(resolve(document), None, user_emulators(FLEET.parent / "robots"), {})
    monkeypatch.setattr(lab, "read_state", lambda _: State(plan, {"noetic": tmp_path}))
    robots = [line.partition(":")[0] for line in lab.stand_ins("fleet")]
    assert robots == ["robot tb3-[01-20]", "robot p3-[01-10]", "robot uav"]


def test_robots_of_which_the_same_is_true_share_a_line(tmp_path: Path) -> None:
    document, _ = load([FLEET])
    assert document is not None
    own = user_emulators(FLEET.parent / "robots")
    plan = plan_of(resolve(document), None, own, {})
    lines = list(robot_lines(plan, State(plan, {"noetic": tmp_path})))
    assert [line.split(":")[0] for line in lines] == [
        "robot epuck-[01-12]",
        "robot rover-[1-6]",
        "robot cart",
        "robot tb3-[01-20]",
        "robot p3-[01-10]",
        "robot uav",
    ]
    assert lines[1] == "robot rover-[1-6]: arduino-rover on /dev/swarm/rover-[1-6]"
    assert lines[4].startswith("robot p3-[01-10]: a stand-in moves and publishes in place of rosaria/RosAria")
