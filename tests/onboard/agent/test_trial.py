"""``trial`` on a host: at an instant of its clock robots are released and programs start, under a guard."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import pytest
from swarm_onboard.agent import stop_latches, trial_guard
from swarm_onboard.agent.errors import FailedError, OperatorGoneError, RefusedError
from swarm_onboard.agent.paths import trial_file
from swarm_onboard.agent.release_store import Home
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.stop_latches import Latch
from swarm_onboard.agent.verbs import trial

from tests.onboard.agent.change import OLD
from tests.onboard.agent.fakehost import FakeHost

NOW = 1_800_000_000.0
UNIT = "koala.service"
SYSTEMD_RUN = '#!/bin/sh\necho "systemd-run $*" >> $SWARM_PREFIX/calls; exit ${NO_GUARD:-0}\n'


@dataclass
class Clock:
    """A clock that goes on only while somebody sleeps; ``meanwhile`` is called then, once."""

    now: float = NOW
    since_boot: float = 100.0
    meanwhile: Callable[[], object] = field(default=lambda: None)

    def sleep(self, seconds: float) -> None:
        self.now += seconds + 1e-5
        self.since_boot += seconds + 1e-5
        meanwhile, self.meanwhile = self.meanwhile, lambda: None
        meanwhile()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(trial, "time", SimpleNamespace(time=lambda: made.now, sleep=made.sleep))
    monkeypatch.setattr(trial, "boot", SimpleNamespace(now=lambda: made.since_boot))
    return made


@pytest.fixture
def home(old: FakeHost, monkeypatch: pytest.MonkeyPatch) -> Home:
    """The host that runs a release, with `koala` and `k3` stopped."""
    monkeypatch.setenv("PATH", old.environment()["PATH"])
    monkeypatch.setenv("SWARM_PREFIX", str(old.prefix))
    (old.prefix / "bin/systemd-run").write_text(SYSTEMD_RUN)
    (old.prefix / "bin/systemd-run").chmod(0o755)
    found = Home("new", str(old.prefix))
    stop(found, "koala", "k3")
    return found


@pytest.fixture
def report() -> Iterator[Report]:
    made = Report("n", io.BytesIO())
    yield made
    made.close()


def stop(home: Home, *robots: str) -> None:
    assert not stop_latches.close(home, robots, Latch("me", NOW))


def start_at(
    at: float,
    *robots: str,
    units: tuple[str, ...] = (UNIT,),
    once: tuple[str, ...] = (),
    seconds: float = 9.0,
) -> trial.Request:
    return trial.Request("new", "me", list(robots), list(units), list(once), at, seconds)


def stopped(home: Home) -> set[str]:
    return set(stop_latches.closed(home))


@pytest.mark.usefixtures("clock")
def test_without_an_instant_the_clock_is_all_that_it_answers(
    home: Home, old: FakeHost, report: Report
) -> None:
    found = trial.handle(start_at(0.0, "koala"), b"", report)
    assert found._replace(free=0, costs=None) == trial.Answer(True, NOW, 0.0, [], [], {}, 0, {}, None)
    assert found.costs is not None
    assert found.free > 0
    assert (stopped(home), old.calls()) == ({"koala", "k3"}, [])


def test_programs_end_before_the_instant_and_start_after_it(
    home: Home, old: FakeHost, clock: Clock, report: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    woken: list[str] = []
    monkeypatch.setattr(trial.robot_motion, "wake", lambda _, robots: woken.extend(robots))
    before: list[object] = []
    clock.meanwhile = lambda: before.extend([stopped(home), UNIT in old.units()])
    at = NOW + 3
    answer = trial.handle(start_at(at, "koala"), b"", report)
    assert before == [{"koala", "k3"}, False]
    assert (answer.released, answer.restarted, stopped(home)) == (["koala"], [UNIT], {"k3"})
    assert answer.clock < at <= answer.began == clock.now
    assert UNIT in old.units()
    assert woken == ["koala"]


def allowed(home: Home) -> bool:
    return Path(home.outside(trial_file(UNIT))).exists()


def test_a_program_of_trials_may_run_from_the_instant_until_the_end(
    home: Home, old: FakeHost, clock: Clock, report: Report
) -> None:
    before: list[bool] = []
    clock.meanwhile = lambda: before.append(allowed(home))
    trial.handle(start_at(NOW + 3, "koala", units=(), once=(UNIT,)), b"", report)
    assert (before, allowed(home), UNIT in old.units()) == ([False], True, True)
    assert json.loads(Path(home.trial_file).read_text())["units"] == [UNIT]
    trial.handle(start_at(0.0, units=(), once=(UNIT,)), b"", report)
    assert not allowed(home)
    assert old.calls().count(f"stop -- {UNIT}") == 2, "before the start and at the end"


def test_a_trial_that_does_not_begin_starts_no_program_of_trials(
    home: Home, old: FakeHost, clock: Clock, report: Report
) -> None:
    clock.meanwhile = lambda: stop(home, "koala")
    with pytest.raises(RefusedError, match="was stopped"):
        trial.handle(start_at(NOW + 3, "koala", units=(), once=(UNIT,)), b"", report)
    assert (allowed(home), UNIT in old.units()) == (False, False)


def test_a_program_that_has_ended_in_a_trial_is_seen(home: Home, old: FakeHost, report: Report) -> None:
    going_on = trial_guard.trial_of(home, "", "me", robots=[], units=[UNIT], seconds=3600.0)
    trial_guard.arm(home, going_on)
    assert trial.handle(start_at(0.0, units=()), b"", report).ended == {}
    (old.prefix / "units" / UNIT).unlink()
    assert set(trial.handle(start_at(0.0, units=()), b"", report).ended) == {UNIT}


@pytest.mark.usefixtures("clock")
def test_the_guard_runs_before_a_robot_is_released(home: Home, old: FakeHost, report: Report) -> None:
    trial.handle(start_at(NOW + 3, "koala"), b"", report)
    assert json.loads(Path(home.trial_file).read_text())["robots"] == ["koala"]
    assert any(call.startswith("systemd-run") for call in old.calls())
    unit = old.read("/etc/systemd/system/swarm-recovery@new.service").decode()
    assert f"ConditionPathExists=|{home.trial_file}\n" in unit


def nothing_started(home: Home, old: FakeHost) -> bool:
    """True if all robots are stopped, the program runs, and nothing is to be stopped later."""
    return stopped(home) == {"koala", "k3"} and UNIT in old.units() and not Path(home.trial_file).exists()


@pytest.mark.usefixtures("clock")
@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (start_at(NOW - 0.5, "koala"), "starts 0.500 s ago"),
        (start_at(NOW + 31, "koala"), "starts in 31.000 s"),
        (
            start_at(NOW + 3, "koala", units=("sshd.service",)),
            "not in the release that runs here: sshd.service",
        ),
        (start_at(0.0, units=(), once=("sshd.service",)), "not in the release that runs here: sshd.service"),
        (start_at(NOW + 3, "koala", "epuck"), "not stopped: epuck"),
        (start_at(NOW + 3, "koala", seconds=0.0), "a trial cannot last 0 s"),
        (start_at(NOW + 3, "koala", seconds=float("nan")), "a trial cannot last nan s"),
        (start_at(NOW + 3, "../koala"), "is not a robot's name"),
        (start_at(NOW + 3, "koala", units=("--now",)), "unit '--now'"),
    ],
)
def test_what_cannot_start_is_refused_and_touches_nothing(
    home: Home, old: FakeHost, report: Report, request_: trial.Request, words: str
) -> None:
    with pytest.raises(RefusedError) as caught:
        trial.handle(request_, b"", report)
    assert words in caught.value.message
    assert caught.value.hint
    assert nothing_started(home, old)
    assert old.calls() == []


def test_a_stop_while_it_waits_holds(home: Home, old: FakeHost, clock: Clock, report: Report) -> None:
    clock.meanwhile = lambda: stop(home, "koala")
    with pytest.raises(RefusedError, match="was stopped"):
        trial.handle(start_at(NOW + 3, "koala"), b"", report)
    assert nothing_started(home, old)


def test_no_trial_takes_the_guard_of_another_ones_robots(
    home: Home, old: FakeHost, clock: Clock, report: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial_guard, "released", lambda _: ["k3"])
    with pytest.raises(RefusedError, match="k3 drives in another trial"):
        trial.handle(start_at(NOW + 3, "koala"), b"", report)
    assert nothing_started(home, old)


@pytest.mark.usefixtures("clock")
def test_no_program_of_trials_takes_the_guard_of_robots_either(
    home: Home, report: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether it starts or not: the guard of the robots that drive goes on."""
    going_on = trial_guard.trial_of(home, "", "me", robots=["koala"], units=[], seconds=3600.0)
    trial_guard.arm(home, going_on)
    stop_latches.release(home, ["koala"])
    with pytest.raises(RefusedError, match="koala drives in another trial"):
        trial.handle(start_at(NOW + 3, units=(), once=(UNIT,)), b"", report)
    stop(home, "koala")
    monkeypatch.setattr(trial.recovery_unit, "install", lambda _: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(OSError, match="full"):
        trial.handle(start_at(NOW + 3, "koala", units=()), b"", report)
    assert trial_guard.going_on(home) == going_on


def test_a_clock_that_is_set_back_starts_nothing(
    home: Home, old: FakeHost, clock: Clock, report: Report
) -> None:
    clock.meanwhile = lambda: setattr(clock, "now", NOW - 3600)
    with pytest.raises(FailedError, match="set back"):
        trial.handle(start_at(NOW + 3, "koala"), b"", report)
    assert nothing_started(home, old)


@pytest.mark.usefixtures("clock")
def test_nothing_starts_that_nobody_waits_for(home: Home, old: FakeHost) -> None:
    gone = io.BytesIO()
    gone.write = lambda _: (_ for _ in ()).throw(BrokenPipeError())  # type: ignore[method-assign]
    with pytest.raises(OperatorGoneError):
        trial.handle(start_at(NOW + 3, "koala"), b"", Report("n", gone))
    assert nothing_started(home, old)


@pytest.mark.usefixtures("clock")
def test_without_its_guard_no_robot_is_released(
    home: Home, old: FakeHost, report: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_GUARD", "1")
    with pytest.raises(FailedError):
        trial.handle(start_at(NOW + 3, "koala"), b"", report)
    assert nothing_started(home, old)


@pytest.mark.usefixtures("clock")
def test_a_program_that_does_not_end_in_time_starts_no_trial(
    home: Home, old: FakeHost, report: Report
) -> None:
    (old.prefix / "slow").touch()
    with pytest.raises(FailedError, match="programs did not end before the start"):
        trial.handle(start_at(NOW + 0.1, "koala"), b"", report)
    assert nothing_started(home, old)
    assert OLD.digest in old.units().values()


def test_during_a_deploy_no_trial_starts(home: Home, old: FakeHost, clock: Clock, report: Report) -> None:
    old.ask({"verb": "lease", "swarm": "new", "run": "a" * 16, "who": "anna@desk (7)", "want": True})
    with pytest.raises(RefusedError, match="locked by anna@desk"):
        trial.handle(start_at(clock.now + 3, "koala"), b"", report)
    assert nothing_started(home, old)


def test_without_a_release_nothing_is_done(tmp_path: Path) -> None:
    host = FakeHost(tmp_path)
    request = {"verb": "trial", **start_at(NOW, "koala")._asdict()}
    answer = host.ask(request).answer
    assert (answer["deployed"], answer["began"]) == (False, 0.0)
    assert trial_guard.unit(Home("new")) == "swarm-trial@new.service"
