"""A robot that moves or is under command is not touched, unless it is stopped first and shown to stand."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from swarm_agent import motion_gate
from swarm_agent.errors import RefusedError
from swarm_agent.release_store import home_of

from tests.packages.agent.test_stop import SWARM, latch_of, running

STANDS = {"measured": True, "zero_at": 5.0, "still_since": 4.0}
TURNS = {"measured": True, "zero_at": 5.0, "still_since": None}
UNMEASURED = {"measured": False, "zero_at": 5.0, "still_since": None}
UNITS = ["koala.service", "koala.pair.service"]


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A host that drives `koala` and `k3`."""
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    release = tmp_path / "opt/swarm/lab/releases/1234"
    release.mkdir(parents=True)
    units = [{"name": "master.service", "robot": ""}]
    units += [{"name": name, "robot": name.partition(".")[0]} for name in (*UNITS, "k3.service")]
    (release / "manifest.json").write_text(json.dumps({"units": units}))
    (tmp_path / "opt/swarm/lab/current").symlink_to("releases/1234")
    return tmp_path


def clear(*units: str, stop: bool = False) -> list[str]:
    notes: list[str] = []
    motion_gate.clear(home_of(SWARM), units or UNITS, stop=stop, who="anna@desk (7)", note=notes.append)
    return notes


@pytest.mark.parametrize(
    ("motion", "why"),
    [
        ({**STANDS, "commander": "joystick (/joystick)"}, "koala is commanded by joystick (/joystick)"),
        ({**UNMEASURED, "commander": "/teleop"}, "koala is commanded by /teleop"),
        ({**TURNS, "commander": ""}, "koala moves: its wheels turn"),
    ],
)
def test_a_robot_in_use_is_not_touched(host: Path, motion: dict[str, object], why: str) -> None:
    with running(host, "koala", **motion), pytest.raises(RefusedError) as refused:
        clear()
    assert refused.value.message == why
    assert "--stop-robots" in refused.value.hint
    assert not latch_of(host, "koala").exists()


@pytest.mark.parametrize(
    "motion", [STANDS, UNMEASURED, {**TURNS, "zero_at": None}, {**STANDS, "commander": "nobody"}]
)
def test_a_robot_without_a_command_that_stands_may_be_touched(host: Path, motion: dict[str, object]) -> None:
    with running(host, "koala", **{"commander": "", **motion}):
        assert clear() == []
    assert not latch_of(host, "koala").exists()


def test_only_the_robots_of_these_units_count(host: Path) -> None:
    with running(host, "koala", **STANDS):  # under command
        assert clear("master.service", "k3.service") == []
        assert motion_gate.busy(home_of(SWARM), ["koala", "k3"]) == {"koala": "is commanded by joy"}
    assert clear() == []  # its driver has ended


def test_it_is_stopped_first_and_stays_stopped(host: Path) -> None:
    with running(host, "koala", **STANDS) as commands:
        assert clear(stop=True) == ["stopping koala"]
        assert commands.held
    assert json.loads(latch_of(host, "koala").read_text())["who"] == "anna@desk (7)"
    with running(host, "koala", ".gate", **STANDS):
        assert clear() == []  # its commander goes on, and it is stopped


def test_wheels_that_still_turn_keep_the_change_away(host: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion_gate, "_STOP", 0.3)
    with running(host, "koala", **TURNS), pytest.raises(RefusedError) as refused:
        clear(stop=True)
    assert "koala was sent its stop, and its wheels still turn" in refused.value.message
    assert latch_of(host, "koala").exists()
