"""The guard of a trial: robots are latched when its time is over, and after a boot in the middle of it."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator, Sequence
from contextlib import suppress
from os import kill
from pathlib import Path

import pytest
from swarm_onboard.agent import robot_motion, stop_latches, trial_guard, trial_units
from swarm_onboard.agent.paths import trial_file
from swarm_onboard.agent.release_store import Home
from swarm_onboard.agent.stop_latches import Latch

from tests.onboard.agent.change import OLD
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.test_stop import running
from tests.timing import PATIENCE, wait_for

LONG = 3600.0  # s
UNIT = "koala.service"
#: Runs what systemd would run.
SYSTEMD_RUN = r"""#!/bin/sh
[ -z "$NO_GUARD" ] || exit 0
for word; do case $word in --property=Environment=*) set_=${word#--property=Environment=} ;; esac; done
while [ "$1" != -- ]; do shift; done; shift
env $set_ "$@" </dev/null >/dev/null 2>&1 &
echo $! >> $SWARM_PREFIX/guards; echo $! > "$SWARM_PREFIX/units/swarm-trial@new.service"
"""


@pytest.fixture
def home(old: FakeHost, monkeypatch: pytest.MonkeyPatch) -> Iterator[Home]:
    """A host with a release, whose guards end with the test."""
    monkeypatch.setenv("PATH", old.environment()["PATH"])
    monkeypatch.setenv("SWARM_PREFIX", str(old.prefix))
    (old.prefix / "bin/systemd-run").write_text(SYSTEMD_RUN)
    (old.prefix / "bin/systemd-run").chmod(0o755)
    (old.prefix / "guards").touch()
    yield Home("new", str(old.prefix))
    for one in guards(old):
        with suppress(ProcessLookupError):
            kill(one, signal.SIGKILL)


def arm(home: Home, robots: list[str], seconds: float, units: Sequence[str] = ()) -> None:
    trial = trial_guard.trial_of(home, "t", "me", robots=robots, units=list(units), seconds=seconds)
    trial_guard.arm(home, trial)


def guards(host: FakeHost) -> list[int]:
    return [int(one) for one in (host.prefix / "guards").read_text().split()]


def ended(home: Home) -> bool:
    return not Path(home.trial_file).exists()


def runs(number: int) -> bool:
    with suppress(OSError):
        return b"trial_guard" in Path(f"/proc/{number}/cmdline").read_bytes()
    return False


def test_the_end_of_the_time_latches_the_robots(home: Home) -> None:
    arm(home, ["koala", "k3"], 0.1)
    wait_for(lambda: ended(home))
    assert {one.who for one in stop_latches.closed(home).values()} == {"me"}
    assert set(stop_latches.closed(home)) == {"koala", "k3"}


def test_it_ends_once_drivers_hold_their_robots(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    arm(home, ["koala"], 0.0)
    with running(Path(home.prefix), "koala", swarm="new", measured=False, zero_at=1.0) as commands:
        assert robot_motion.ask(robot_motion.sockets(home), PATIENCE, bool)
        assert not commands.held
        trial_guard.run(home)
        assert commands.held


def test_a_stop_by_the_operator_ends_it_early(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    """So robots that are released by hand after a trial was given up stay released."""
    monkeypatch.setenv("NO_GUARD", "1")
    arm(home, ["koala", "k3"], LONG)
    due = [["koala"], ["k3"]]
    monkeypatch.setattr(
        trial_guard.time, "sleep", lambda _: stop_latches.close(home, due.pop(0), Latch("operator", 1.0))
    )
    trial_guard.run(home)
    assert due == []
    assert ended(home)
    assert {one.who for one in stop_latches.closed(home).values()} == {"operator"}


@pytest.mark.parametrize("robots", [["koala"], []])
def test_units_of_trials_end_with_it_and_wait_for_the_next(
    home: Home, old: FakeHost, monkeypatch: pytest.MonkeyPatch, robots: list[str]
) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    trial_units.allow(home, [UNIT])
    arm(home, robots, 0.0, [UNIT])
    trial_guard.run(home)
    assert ended(home)
    assert not Path(home.outside(trial_file(UNIT))).exists()
    stops, starts = (f"{verb} -- {UNIT}" for verb in ("stop", "start"))
    calls = [call for call in old.calls() if call in (stops, starts)]
    assert calls == [stops, starts], "the start, which is skipped, shows that it waits"


def test_a_trial_ends_the_units_of_the_one_before(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    trial_units.allow(home, [UNIT, "k3.service"])
    arm(home, [], LONG, [UNIT, "k3.service"])
    arm(home, [], LONG, ["k3.service"])
    assert not Path(home.outside(trial_file(UNIT))).exists()
    assert Path(home.outside(trial_file("k3.service"))).exists()


def test_a_unit_goes_on_after_a_person_has_released_the_robots(
    home: Home, old: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    arm(home, ["koala"], LONG, [UNIT])
    rounds: list[bool] = []

    def sleep(_: float) -> None:
        rounds.append(f"stop -- {UNIT}" in old.calls())
        if len(rounds) == 1:
            trial_guard.leave(home, ["koala"])
        elif len(rounds) == 4:
            trial_guard.disarm(home)

    monkeypatch.setattr(trial_guard.time, "sleep", sleep)
    trial_guard.run(home)
    assert rounds == [False] * 4


def test_a_removed_swarm_leaves_no_file_that_lets_a_unit_start(home: Home, old: FakeHost) -> None:
    trial_units.allow(home, [UNIT])
    assert old.ask({"verb": "remove", "swarm": "new", "who": "me"}).answer
    assert not Path(home.outside(trial_file(UNIT))).exists()


def test_a_unit_that_failed_in_a_trial_keeps_its_state(home: Home, old: FakeHost) -> None:
    (old.prefix / "units" / UNIT).unlink()
    (old.prefix / f"failed-{UNIT}").touch()
    trial_units.end(home, [UNIT])
    assert f"start -- {UNIT}" not in old.calls()


def test_robots_that_still_wait_for_their_start_do_not_end_it(
    home: Home, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    stop_latches.close(home, ["koala"], Latch("operator", 1.0))
    arm(home, ["koala"], LONG)
    armed: list[bool] = []

    def sleep(_: float) -> None:
        armed.append(not ended(home))
        if len(armed) == 2:
            stop_latches.release(home, ["koala"])
        elif len(armed) == 3:
            stop_latches.close(home, ["koala"], Latch("operator", 1.0))

    monkeypatch.setattr(trial_guard.time, "sleep", sleep)
    trial_guard.run(home)
    assert armed == [True] * 3


def test_the_guard_of_an_earlier_trial_ends(home: Home, old: FakeHost) -> None:
    arm(home, ["koala"], LONG)
    arm(home, ["k3"], 0.1)
    assert "stop -- swarm-trial@new.service" in old.calls()
    wait_for(lambda: ended(home))
    assert set(stop_latches.closed(home)) == {"k3"}


def test_a_guard_whose_trial_is_gone_latches_nothing(home: Home, old: FakeHost) -> None:
    arm(home, ["koala"], LONG)
    trial_guard.disarm(home)
    wait_for(lambda: not runs(guards(old)[0]))
    assert stop_latches.closed(home) == {}


@pytest.mark.parametrize("number", [0, 1])
def test_a_boot_in_the_middle_of_a_trial_latches_its_robots(home: Home, old: FakeHost, number: int) -> None:
    arm(home, ["koala"], LONG)
    kill(guards(old)[0], signal.SIGKILL)
    old.boot(number)
    assert old.recover() == 0
    assert ended(home) == (number == 1)
    assert set(stop_latches.closed(home)) == ({"koala"} if number else set())


def test_robots_take_part_until_they_are_stopped_or_their_host_boots(
    home: Home, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    assert trial_guard.released(home) == []
    arm(home, ["koala", "k3"], LONG)
    assert trial_guard.released(home) == ["koala", "k3"]
    stop_latches.close(home, ["koala"], Latch("me", 0.0))
    assert trial_guard.released(home) == ["k3"]
    file = Path(home.trial_file)
    file.write_text(json.dumps({**json.loads(file.read_text()), "boot_id": "another"}))
    assert trial_guard.released(home) == []


def test_a_robot_that_a_person_releases_leaves_the_trial(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    arm(home, ["koala", "k3"], LONG)
    trial_guard.leave(home, ["k3", "epuck"])
    assert trial_guard.released(home) == ["koala"]
    trial_guard.leave(home, ["koala"])
    assert ended(home)
    arm(home, ["koala"], LONG, [UNIT])
    trial_guard.leave(home, ["koala"])
    assert not ended(home), "its unit ends with the trial all the same"


def test_a_damaged_file_does_not_keep_the_host_from_its_recovery(home: Home, old: FakeHost) -> None:
    Path(home.trial_file).write_text('{"robots": 3}')
    old.boot(1)
    assert old.recover() == 0
    assert old.observe().release == OLD.digest
