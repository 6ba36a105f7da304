"""``stop`` and ``start`` on a host: latches on its disk, drivers that answer on their sockets."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
from swarm_onboard.agent import robot_motion
from swarm_onboard.agent.paths import stop_file
from swarm_onboard.agent.robot_motion import RobotMotion
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.verbs import start, stop
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.stop_latch import StopLatch

SWARM = "lab"


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A host with a release that drives `koala`, and has a gate before `cart`."""
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    release = tmp_path / "opt/swarm/lab/releases/0123456789abcdef"
    (release / "params").mkdir(parents=True)
    for name in ("koala", "cart.gate"):
        (release / f"params/{name}.yaml").write_text("")
    (tmp_path / "opt/swarm/lab/current").symlink_to("releases/0123456789abcdef")
    return tmp_path


def latch_of(host: Path, robot: str, swarm: str = SWARM) -> Path:
    return Path(f"{host}{stop_file(swarm, robot)}")


@contextmanager
def running(
    host: Path, robot: str, part: str = "", swarm: str = SWARM, **motion: object
) -> Iterator[CommandMailbox]:
    """A loop like a driver's: it looks at its latch and answers with ``motion`` (it calls callables)."""
    folder = host / f"run/swarm-{swarm}.{robot}{part}"
    folder.mkdir(parents=True)
    commands = CommandMailbox()
    latch = StopLatch(str(latch_of(host, robot, swarm)), commands, str(folder))

    def answer() -> dict[str, object]:
        now = {name: value() if callable(value) else value for name, value in motion.items()}
        return {"held": commands.held, "commander": "joy", "trouble": "", **now}

    def loop() -> None:
        while not commands.stopped:
            latch.look()
            latch.answer(answer)
            commands.wait(30.0, latch.listens_to())

    thread = threading.Thread(target=loop)
    thread.start()
    try:
        yield commands
    finally:
        commands.stop()
        thread.join()


def stopped(*robots: str, others: bool = False, patience: float = 5.0) -> dict[str, RobotMotion]:
    request = stop.Request(SWARM, "me@desk (1)", list(robots), others, patience)
    answer = stop.handle(request, b"", Report("n"))
    assert answer.deployed
    return answer.robots


def started(*robots: str, others: bool = False) -> list[str]:
    return start.handle(start.Request(SWARM, list(robots), others), b"", Report("n")).released


def test_a_driver_is_woken_by_its_latch_and_answers_from_the_wheels(
    host: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = time.monotonic()
    later = began + 0.2
    clocks = SimpleNamespace(time=lambda: 1_700_000_000.5, monotonic=lambda: began)
    monkeypatch.setattr(stop, "time", clocks)
    with running(host, "koala", zero_at=later, measured=True, still_since=later) as commands:
        found = stopped("koala")["koala"]
        assert commands.held
    assert (found.proof, found.latched, found.commander) == ("wheels", True, "joy")
    assert found.seconds == round(later - began, 3)  # not when it answered
    latch = json.loads(latch_of(host, "koala").read_text())
    assert latch["who"] == "me@desk (1)"
    assert latch["since"] == 1_700_000_000.5


@pytest.mark.parametrize(
    ("motion", "proof", "trouble"),
    [
        ({"zero_at": 1.0, "confirms": True, "measured": False}, "confirmed", "its wheels are not measured"),
        ({"zero_at": 1.0, "confirms": False, "measured": False}, "sent", "its wheels are not measured"),
        ({"zero_at": 1.0, "confirms": True, "measured": True}, "confirmed", "its wheels still turned"),
        (
            {"zero_at": 1.0, "measured": True, "by": "odometry", "trouble": "it moves by its odometry"},
            "sent",
            "it moves by its odometry",
        ),
        ({"zero_at": None, "trouble": "no cable"}, "none", "no cable"),
    ],
)
def test_what_is_not_shown_by_the_wheels_is_no_proof(host: Path, motion, proof: str, trouble: str) -> None:
    with running(host, "koala", **motion):
        found = stopped("koala", patience=0.2)["koala"]
    assert (found.proof, found.trouble) == (proof, trouble)


@pytest.mark.parametrize(
    ("motion", "enough"),
    [
        ({"measured": False, "pending": True}, False),
        ({"measured": True, "pending": True, "still_since": None}, False),
        ({"measured": False, "pending": False}, True),
        ({"measured": True, "pending": False, "still_since": 2.0}, True),
    ],
)
def test_odometry_that_is_still_to_come_is_waited_for(motion: dict[str, object], enough: bool) -> None:
    answer = {"held": True, "zero_at": 1.0, **motion}
    assert robot_motion.proven({"koala": answer}, ["koala"]) is enough


def test_without_a_driver_the_next_start_is_latched(host: Path) -> None:
    found = stopped("koala")["koala"]
    assert (found.latched, found.runs, found.proof) == (True, False, "none")
    assert latch_of(host, "koala").exists()


def test_a_robot_that_nothing_guards_is_not_called_stopped(host: Path) -> None:
    found = stopped("free")["free"]
    assert not found.latched
    assert found.trouble == stop.UNGUARDED
    assert not latch_of(host, "free").exists()


def test_robots_that_run_and_are_not_in_the_spec_are_stopped_too(host: Path) -> None:
    with running(host, "old", ".gate", zero_at=1.0, measured=False):
        assert set(stopped("koala")) == {"koala"}
        assert set(stopped("koala", others=True)) == {"koala", "old"}


def test_a_disk_that_cannot_be_written_fails_only_by_robot(host: Path) -> None:
    latch_of(host, "koala").parent.parent.mkdir(parents=True)
    latch_of(host, "koala").parent.write_text("in the way")
    found = stopped("koala")["koala"]
    assert not found.latched
    assert "cannot be written" in found.trouble


def test_start_releases_what_was_stopped_and_wakes_its_driver(host: Path) -> None:
    with running(host, "koala", zero_at=1.0, measured=False) as commands:
        stopped("koala", "cart")
        assert started("koala") == ["koala"]
        end = time.monotonic() + 20
        while commands.held and time.monotonic() < end:
            time.sleep(0.005)
        assert not commands.held
    assert started("koala") == []
    assert latch_of(host, "cart").exists()
    assert started(others=True) == ["cart"]
    assert not latch_of(host, "cart").exists()


def test_a_swarm_that_is_not_deployed_has_no_latch(host: Path) -> None:
    (host / "opt/swarm/lab/current").unlink()
    request = stop.Request(SWARM, "", ["koala"], others=True, patience=1.0)
    assert stop.handle(request, b"", Report("n")) == stop.Answer(deployed=False, elapsed=0.0, robots={})
    assert not (host / "etc").exists()
