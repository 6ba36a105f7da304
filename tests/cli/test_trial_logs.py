"""The logs in a capsule: those of the trial alone, of each host that answers, and harmless."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from swarmctl.cli import trial_logs
from swarmctl.cli.trial import Trial
from swarmctl.cli.trial_hosts import TrialHosts
from swarmctl.deploy import host_systems
from swarmctl.deploy.host_records import HostRecords
from swarmctl.deploy.trial_start import Clock
from swarmctl.health.host_logs import Entry, HostLog
from swarmctl.health.root_cause import Diagnosis
from swarmctl.health.swarm_health import Look, Status
from swarmctl.plan.command_history import Record, Span, Start
from swarmctl.remote.parallel_hosts import Finished, Note
from swarmctl.remote.transport import HostError, Kind, Target

BEGAN, ENDED = 1_780_000_000.0, 1_780_000_060.0
HOSTS = ("laptop", "pi", "away")


def entry(at: float, message: str, source: str = "k3") -> Entry:
    return Entry(at, "pi", source, "info", message)


@pytest.fixture
def fetched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Fetches what hosts answer; returns the text of each log."""

    def called(outcomes: dict[str, HostLog | HostError | KeyboardInterrupt]) -> dict[str, str]:
        def read(question: Any, targets: list[Target], _: object, *, parallel: int) -> Iterator[Any]:
            assert (question.swarm, question.since, parallel) == ("lab", BEGAN, 2)
            assert question.request("pi").parts == []
            assert [one.host for one in targets] == list(HOSTS)
            for host, one in outcomes.items():
                if isinstance(one, KeyboardInterrupt):
                    raise one
                yield Note(host, "reading")
                yield Finished(host, one, 0.0)

        monkeypatch.setattr(trial_logs, "host_logs", read)
        targets: Any = {host: Target(host, "192.0.2.1", "robot") for host in HOSTS}
        folder, transport = tmp_path / "logs", Any
        trial_logs.fetch("lab", targets, transport, folder, began=BEGAN, ended=ENDED, parallel=2)  # type: ignore[arg-type]
        return {one.name: one.read_text("utf-8") for one in sorted(folder.iterdir())}

    return called


def test_a_log_has_what_was_logged_in_the_trial(fetched: Any) -> None:
    entries = [
        entry(BEGAN - 0.1, "too early"),
        entry(BEGAN, "first"),
        entry(ENDED, "last", "k3/gate"),
        entry(BEGAN + 1, "second\n  with more"),
        entry(ENDED + 0.1, "too late"),
    ]
    assert fetched({"pi": HostLog(entries, 2.5, cut=False), "laptop": HostLog([], 0.0, cut=False)}) == {
        "laptop.log": "",
        "pi.log": "2026-05-28T20:26:42.500Z k3  info   first\n"
        "2026-05-28T20:26:43.500Z k3  info   second\n"
        "      with more\n"
        "2026-05-28T20:27:42.500Z k3/gate  info   last\n",
    }


def test_what_hosts_log_cannot_forge_lines_or_control_a_terminal(fetched: Any) -> None:
    found = fetched({"pi": HostLog([entry(BEGAN, "a\x1b[2J\r\u202eb\nc", "k3\n\x07")], 1e300, cut=False)})
    assert found == {"pi.log": "- k3\\x0a\\x07  info   a\\x1b[2J\\x0d\\u202eb\n    c\n"}


def test_a_host_that_does_not_answer_costs_its_log_alone(
    fetched: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    away = HostError(Kind.UNREACHABLE, "away: no answer\x1b[2J")
    found = fetched({"away": away, "pi": HostLog([entry(BEGAN, "first")], 0.0, cut=True)})
    assert set(found) == {"pi.log"}
    assert capsys.readouterr().err == (
        "warning: no log of away: no answer\\x1b[2J\nwarning: pi has logged more, only the newest are kept\n"
    )


def test_a_folder_that_cannot_be_made_is_named(
    fetched: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "logs").write_text("")
    with pytest.raises(NotADirectoryError):  # of the test itself
        fetched({"pi": HostLog([], 0.0, cut=False)})
    assert "warning: no log of pi: cannot write" in capsys.readouterr().err


def test_ctrl_c_leaves_the_logs_that_are_there(fetched: Any, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        fetched({"pi": HostLog([], 0.0, cut=False), "laptop": KeyboardInterrupt()})
    assert (tmp_path / "logs/pi.log").exists()


def test_commands_of_the_trial_are_kept_by_the_clock_of_their_host(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def span(at: float, seconds: float | None, node: str) -> Span:
        return Span(at, "joystick", node, "10.0.0.1", seconds, ongoing=False)

    spans = (
        span(BEGAN + 99, 0.5, "/before"),
        span(BEGAN + 98, None, "/of a driver that was killed"),
        span(BEGAN + 99, 30.0, "/into"),
        span(BEGAN + 100, None, "/within"),
        span(ENDED + 101, 1.0, "/after"),
    )
    starts = (Start(BEGAN + 99, "a" * 16, (), changed=True, cut=0),)
    found = HostRecords([], {"k3": Record((*starts, *spans)), "koala": Record(problem="is damaged\x1b[2J")})
    outcomes = {"pi": found, "away": HostError(Kind.UNREACHABLE, "away: no answer")}
    monkeypatch.setattr(
        trial_logs, "command_records", lambda *_, **__: [Finished(*one, 0.0) for one in outcomes.items()]
    )
    file, transport = tmp_path / "commands.json", Any
    targets = {host: Target(host, "192.0.2.1", "robot") for host in outcomes}
    trial_logs.fetch_commands(
        "lab", targets, transport, file,  # type: ignore[arg-type]
        began=BEGAN, ended=ENDED, ahead={"pi": 100.0}, parallel=2,
    )  # fmt: skip
    rows = json.loads(file.read_text("utf-8"))
    assert [(one["robot"], one["node"]) for one in rows] == [("k3", "/into"), ("k3", "/within")]
    assert capsys.readouterr().err.splitlines() == [
        "warning: not known who commanded robots of away: no answer",
        "warning: the record of who commanded koala on pi is damaged\\x1b[2J",
    ]


LOOK = Look(Status("lab", (), Diagnosis(())), BEGAN, 1.0)


def test_a_trial_starts_with_the_first_host_by_the_operators_clock() -> None:
    trial = Trial(1, LOOK)
    assert trial.start == LOOK.began
    trial.began = {"laptop": BEGAN + 10.0, "pi": BEGAN + 109.5}
    trial.clocks = {"laptop": Clock(0.0, 0.25), "pi": Clock(100.0, 0.5)}
    assert trial.start == BEGAN + 9.5


class Idle(TrialHosts):
    """Hosts of a trial in which nothing happens."""

    def __init__(self) -> None:
        self._swarm: Any = SimpleNamespace(name="lab")
        self._experiment: Any = SimpleNamespace(record=(), programs=(), until=())
        self._targets, self._once, self._parallel = {}, {}, 2
        self._connect = self._recording = lambda **_: None  # type: ignore[method-assign]
        self._look = lambda: LOOK

    def _ready(self, number: int) -> Trial:
        return Trial(number, LOOK)

    def _record(self, recording: object) -> None: ...

    def _start(self, trial: Trial) -> None: ...

    def _watch(self, trial: Trial, topics: object) -> None: ...

    def _stop(self) -> Iterator[Any]:
        return iter(())

    def _end(self, units: object, *, failures: bool = True) -> Iterator[str]:
        return iter(())


def test_ctrl_c_while_logs_are_fetched_leaves_the_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(host_systems, "systems", lambda *_, **__: {})
    assert Idle().run(1, tmp_path).outcome == "completed"

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(trial_logs, "fetch", interrupted)
    trial = Idle().run(1, tmp_path)
    assert (trial.outcome, trial.after) == ("interrupted", LOOK)
