"""What a host sends of its robots several times a second: from their drivers, and as far as they answer."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from swarm_onboard.agent import trial_guard
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.verbs import telemetry
from swarm_onboard.agent.verbs.telemetry import RobotTelemetry, Telemetry

from swarmctl.remote import agent_client
from swarmctl.remote.answer_check import of_note
from tests.onboard.agent.test_stop import SWARM, running

MOVES = {"pose": [1.23456, 2.0, 0.5], "driven": [0.1, 0.0], "commanded": [0.2, 0.0], "battery": 0.51234}


@pytest.fixture(autouse=True)
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    return tmp_path


def sent(*missing: str) -> list[Telemetry]:
    sink = io.BytesIO()
    devices = dict.fromkeys(missing, "/no/such/device") | {"here": "/dev/null"}
    answer = telemetry.handle(telemetry.Request(SWARM, devices, 0.05, 0.2), b"", Report("n", sink))
    lines = [line for line in sink.getvalue().splitlines() if line]
    notes = [agent_client._parse(line.partition(b" ")[2])["note"] for line in lines]
    assert answer.sent == len(notes)
    return [of_note(note, Telemetry, "the note") for note in notes]


def test_each_robot_is_as_its_driver_knows_it(host: Path) -> None:
    with running(host, "koala", **MOVES), running(host, "k3", part=".gate", trouble="no odometry"):
        notes = sent("k3")
    assert len(notes) > 1
    assert notes[-1].robots == {
        "koala": RobotTelemetry(
            pose=[1.2346, 2.0, 0.5], driven=[0.1, 0.0], commanded=[0.2, 0.0], battery=0.5123,
            commander="joy", trouble="", held=False,
        ),
        "k3": RobotTelemetry(None, None, None, "joy", "no odometry", held=False, battery=None),
    }  # fmt: skip
    assert notes[-1].missing == ["k3"]


def test_a_driver_that_answers_nonsense_costs_its_own_numbers(host: Path) -> None:
    nonsense = {"pose": "here", "driven": [1], "commanded": {}}
    with running(host, "koala", **nonsense), running(host, "k3", **MOVES):
        robots = sent()[-1].robots
    assert (robots["koala"].pose, robots["koala"].driven) == (None, None)
    assert robots["k3"].driven == [0.1, 0.0]


def test_a_host_without_drivers_sends_that() -> None:
    assert sent()[-1] == Telemetry({}, [], [], "", 0.0)


def test_the_trial_that_goes_on_has_its_name_and_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial_guard.boot, "now", lambda: 100.0)
    home = home_of(SWARM)
    going_on = trial_guard.trial_of(home, "circles, trial 3", "me", robots=[], units=[], seconds=31.0)
    monkeypatch.setattr(trial_guard, "going_on", lambda _: going_on)
    note = sent()[-1]
    assert (note.trial, note.left) == ("circles, trial 3", 31.0 - trial_guard.GRACE)
