"""What ends a trial, and a reset of its robots, by the answers of hosts: robots stop, whatever it is."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from swarm_onboard.agent.verbs import trial as verb

from swarmctl.cli import trial_hosts
from swarmctl.cli.trial import Trial, TrialError
from swarmctl.cli.trial_hosts import TrialHosts
from swarmctl.deploy.trial_start import Clock, Seen
from swarmctl.health.root_cause import Diagnosis
from swarmctl.health.swarm_health import Look, Status
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind

HOME = "swarm-lab.home.service"
ANSWER = verb.Answer(True, 0.0, 0.0, ["k3"], [], {}, 0, {}, None)
AWAY = HostError(Kind.LOST, "pi: the connection was lost")


class Hosts(TrialHosts):
    """Two hosts: `pi` has the robot, `laptop` the program of `reset`. They give one answer each time."""

    def __init__(self, *answers: dict[str, verb.Answer | HostError], trouble: str = "") -> None:
        self._swarm: Any = SimpleNamespace(
            name="lab",
            programs=dict.fromkeys(
                ("home", "circle"),
                SimpleNamespace(host="laptop", declared=SimpleNamespace(lifecycle="trial")),
            ),
            hosts={one: SimpleNamespace(optional=False) for one in ("pi", "laptop")},
        )
        self._name, self._parallel = "circles", 2
        self._experiment: Any = SimpleNamespace(reset="home", programs=["circle"], duration=3600.0)
        self._robots, self._units, self._once = {"pi": ["k3"]}, {}, {"laptop": [HOME]}
        self._targets: Any = dict.fromkeys(("pi", "laptop"))
        self._all = self._targets, self._robots
        self._connect = lambda **_: None  # type: ignore[assignment,return-value]
        self.answers, self.trouble, self.done = list(answers), trouble, list[str]()

    def _stop(self) -> Iterator[Any]:
        self.done.append("stop")
        yield SimpleNamespace(robot="k3", host="pi", state="stands", trouble="", seconds=0.1)

    def _begin(self, *_: object) -> Any:
        self.done.append("begin")
        return {"pi": Clock(0.0, 0.0)}, dict.fromkeys(("pi", "laptop"), ANSWER)

    def _end(self, units: Any, *, failures: bool = True) -> Iterator[str]:
        self.done.append(f"end {' '.join(one for of_host in units.values() for one in of_host)}")
        if failures and self.trouble:
            yield self.trouble


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def look(*_: object, **__: object) -> Iterator[Any]:
        for host, one in hosts[0].answers.pop(0).items():
            outcome = one if isinstance(one, HostError) else Seen(one, Clock(0.0, 0.0))
            yield Finished(host, outcome, 0.0)

    hosts.clear()
    monkeypatch.setattr(trial_hosts.trial_start, "seen", look)
    monkeypatch.setattr(trial_hosts.time, "sleep", lambda _: None)


hosts: list[Hosts] = []


def made(*answers: dict[str, verb.Answer | HostError], trouble: str = "") -> Hosts:
    hosts.append(Hosts(*answers, trouble=trouble))
    return hosts[0]


def ended(result: str) -> dict[str, verb.Answer | HostError]:
    return {"pi": ANSWER, "laptop": ANSWER._replace(released=[], ended={HOME: result})}


RUNNING: dict[str, verb.Answer | HostError] = {"pi": ANSWER, "laptop": ANSWER}


@pytest.mark.usefixtures("seen")
def test_a_reset_ends_with_its_program_also_over_a_lost_connection() -> None:
    one = made(RUNNING, {"pi": AWAY, "laptop": AWAY}, ended("success"))
    one.reset()
    ends = f"end swarm-lab.circle.service {HOME}"
    assert (one.done, one.answers) == (["stop", ends, "begin", "stop", f"end {HOME}"], [])


@pytest.mark.usefixtures("seen")
@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (ended("exit-code"), f"{HOME} on laptop failed: exit-code"),
        ({**RUNNING, "pi": ANSWER._replace(released=[])}, "k3 was stopped before the end"),
    ],
)
def test_a_reset_that_fails_or_is_stopped_stops_the_robots(
    answer: dict[str, verb.Answer | HostError], words: str
) -> None:
    one = made(RUNNING, answer)
    with pytest.raises(TrialError, match=words):
        one.reset()
    assert one.done[-2:] == ["stop", f"end {HOME}"]


@pytest.mark.usefixtures("seen")
def test_a_program_that_cannot_be_ended_makes_a_reset_fail() -> None:
    one = made(ended("success"), trouble="laptop: no answer")
    with pytest.raises(TrialError, match="laptop: no answer"):
        one.reset()


def topics(**values: Any) -> Any:
    return SimpleNamespace(**{"met": False, "trouble": "", **values})


@pytest.mark.usefixtures("seen")
def test_what_topics_show_ends_a_trial_early() -> None:
    made()._watch(Trial(1, Look(Status("lab", (), Diagnosis(())), 0.0, 0.0)), topics(met=True))


@pytest.mark.usefixtures("seen")
@pytest.mark.parametrize(
    ("shown", "answer", "words"),
    [
        (topics(trouble="laptop: no rostopic"), RUNNING, "`until`: laptop: no rostopic"),
        (topics(), ended("signal"), f"{HOME} on laptop failed: signal"),
        (topics(), {**RUNNING, "pi": ANSWER._replace(released=[])}, "k3 was stopped before the end"),
    ],
)
def test_a_trial_ends_once_it_has_failed(
    shown: Any, answer: dict[str, verb.Answer | HostError], words: str
) -> None:
    with pytest.raises(TrialError, match=words):
        made(answer)._watch(Trial(1, Look(Status("lab", (), Diagnosis(())), 0.0, 0.0)), shown)
