"""A robot that moves or is under command is not touched unless it is stopped first and confirmed to stand."""

from __future__ import annotations

import json
import re
import shutil
import time
from pathlib import Path

import pytest
from swarm_onboard.agent import motion_gate
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.release_store import home_of

from tests.onboard.agent.test_stop import SWARM, latch_of, running

STANDS = {"measured": True, "zero_at": 5.0, "still_since": 4.0}
TURNS = {"measured": True, "zero_at": 5.0, "still_since": None}
UNMEASURED = {"measured": False, "zero_at": 5.0, "still_since": None}
UNITS = ["koala.service", "koala.pair.service"]


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A host that drives `koala` and `k3`."""
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    release = tmp_path / "opt/swarm/lab/releases/0123456789abcdef"
    release.mkdir(parents=True)
    units = [{"name": "master.service", "robot": ""}]
    units += [{"name": name, "robot": name.partition(".")[0]} for name in (*UNITS, "k3.service")]
    (release / "manifest.json").write_text(json.dumps({"units": units}))
    (tmp_path / "opt/swarm/lab/current").symlink_to("releases/0123456789abcdef")
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
        ({**TURNS, "commander": ""}, "koala is not confirmed to stand by its wheels"),
        (
            {**TURNS, "commander": "", "by": "odometry"},
            "koala is not confirmed to stand by its odometry",
        ),
    ],
)
def test_a_robot_in_use_is_not_touched(host: Path, motion: dict[str, object], why: str) -> None:
    with running(host, "koala", **motion), pytest.raises(RefusedError) as refused:
        clear()
    assert refused.value.message == why
    assert "--stop-robots" in refused.value.hint
    assert not latch_of(host, "koala").exists()


@pytest.mark.parametrize(
    "motion",
    [
        STANDS,
        UNMEASURED,
        {**TURNS, "zero_at": None},
        {**TURNS, "pending": True},  # odometry shows nothing in time
        {**STANDS, "commander": "nobody"},
    ],
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


def test_a_stopped_robot_gets_time_to_show_that_it_stands(
    host: Path,
) -> None:
    shown = time.monotonic() + 0.3

    def still_since() -> float | None:
        return 4.0 if time.monotonic() >= shown else None

    with running(host, "koala", held=True, **{**TURNS, "still_since": still_since}):
        assert clear() == []


def test_wheels_that_still_turn_keep_the_change_away(host: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion_gate, "_STOP", 0.3)
    with running(host, "koala", **TURNS), pytest.raises(RefusedError) as refused:
        clear(stop=True)
    assert "koala was sent its stop, and its wheels still turn" in refused.value.message
    assert latch_of(host, "koala").exists()


@pytest.mark.parametrize("stop", [False, True])
@pytest.mark.parametrize(
    ("motion", "text"),
    [
        ({"docked": False}, "koala is not docked, as `maintenance` asks"),
        (
            {"docked": None},
            "koala may be away from its dock, and `maintenance` asks for `docked`: it is not read",
        ),
        (
            {"trouble": "no driver is connected with its gate"},
            "`docked`: no driver is connected with its gate",
        ),
        (None, "asks for `docked`: its driver does not run"),
    ],
)
def test_a_robot_that_is_not_seen_at_its_dock_is_not_touched(
    host: Path, motion: dict[str, object] | None, text: str, stop: bool
) -> None:
    terms(host, docked=True)
    if motion is None:
        assert text in refusal(stop=stop)
    else:
        with running(host, "koala", ".gate", **{**STANDS, "commander": "", **motion}):
            assert text in refusal(stop=stop)


def test_a_docked_robot_may_be_touched(host: Path) -> None:
    terms(host, docked=True)
    with running(host, "koala", ".gate", **STANDS, commander="", docked=True):
        assert clear() == []


def terms(host: Path, **wanted: float) -> None:
    text = json.dumps({"koala": {"idle": 0.0, "battery": 0.0, **wanted}})
    (host / "opt/swarm/lab/current/maintenance.json").write_text(text)


def refusal(*, stop: bool = False) -> str:
    with pytest.raises(RefusedError) as refused:
        clear(stop=stop)
    assert "`maintenance`" in refused.value.hint
    return refused.value.message


def test_a_robot_is_touched_once_it_was_idle_long_enough(host: Path) -> None:
    terms(host, idle=300.0)
    quiet = {**STANDS, "commander": ""}
    now = time.monotonic()
    with running(host, "koala", **quiet, idle_since=now - 100):
        found = re.fullmatch(r"koala has been idle for (\d+) s of the 300 s of `maintenance`", refusal())
        assert found
        assert 100 <= int(found[1]) < 290
        assert motion_gate.busy(home_of(SWARM), ["koala"], stop=True) == {}  # what a deploy looks at first
    shutil.rmtree(host / "run")  # as systemd does when the driver has ended
    assert clear() == []  # nothing passes a command on
    with running(host, "koala", ".gate", **quiet, idle_since=now - 301):
        assert clear() == []


def test_idle_time_that_nobody_measures_does_not_hold(host: Path) -> None:
    terms(host, idle=300.0)
    with running(host, "koala", **STANDS, commander="", idle_since=None):
        assert refusal().startswith("koala is idle for an unknown time, `maintenance` asks for 300 s")


@pytest.mark.parametrize("stop", [False, True])
@pytest.mark.parametrize(
    ("motion", "text"),
    [
        ({"battery": 0.312}, "koala has its battery at 0.31, `maintenance` asks for 0.4"),
        ({"battery": None}, "is not known, `maintenance` asks for 0.4: it is not read"),
        ({"battery": None, "trouble": "the line is gone"}, "asks for 0.4: the line is gone"),
        (None, "is not known, `maintenance` asks for 0.4: its driver does not run"),
    ],
)
def test_a_battery_below_its_term_or_unknown_keeps_the_change_away(
    host: Path, motion: dict[str, object] | None, text: str, stop: bool
) -> None:
    terms(host, battery=0.4)
    if motion is None:
        assert text in refusal(stop=stop)
    else:
        with running(host, "koala", **{**STANDS, "commander": "", **motion}):
            assert text in refusal(stop=stop)
    assert not latch_of(host, "koala").exists()


def test_a_battery_at_its_term_lets_the_change_in(host: Path) -> None:
    terms(host, battery=0.4)
    with running(host, "koala", **STANDS, commander="", battery=0.4):
        assert clear() == []
        assert clear("k3.service") == []


def test_damaged_terms_hold_for_nobody(host: Path) -> None:
    (host / "opt/swarm/lab/current/maintenance.json").write_text("{")
    with pytest.raises(RefusedError) as refused:
        clear()
    assert refused.value.message == "koala has unknown terms: maintenance.json of its release is damaged"
