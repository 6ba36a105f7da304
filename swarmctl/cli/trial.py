"""One trial on the hosts: robots stand, start together, and stop with proof."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from swarm_onboard.agent import robot_motion
from swarm_onboard.agent.verbs import recording as recording_verb
from swarm_onboard.agent.verbs import trial as trial_verb

from swarmctl.cli import console, readiness_look, trial_logs
from swarmctl.cli.recording_hosts import RecordingHosts
from swarmctl.deploy import host_systems, robot_stop, trial_start
from swarmctl.health import trial_troubles
from swarmctl.remote import operators
from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import Event, Finished, R, results_of
from swarmctl.remote.transport import HostError, Target, Transport
from swarmctl.render.recording_requests import requests
from swarmctl.swarm import names
from swarmctl.views import robot_stop as view
from swarmctl.views.escape import printable

if TYPE_CHECKING:
    from swarmctl.capsule.capsule_index import Judged
    from swarmctl.cli.swarm_look import Looking
    from swarmctl.deploy.host_systems import System
    from swarmctl.deploy.robot_stop import RobotStop
    from swarmctl.deploy.trial_start import Clock
    from swarmctl.health.swarm_health import Look
    from swarmctl.spec.experiment_model import Experiment
    from swarmctl.swarm.resolved import Swarm

_LEAD = 4.0  # s in which all hosts get the request, and stop the programs
_MEGABYTES = 256  # of a bag
_LOOK = 10.0  # s between two looks at hosts in a trial
_LAST = 2.0  # s before its end: the last look
_SPARE = 30.0  # s that a recording goes on without its operator


class TrialError(Exception):
    """A trial did not begin, or did not go to its end."""


@dataclass
class Trial:
    """What came of one trial; ``began`` by host, s since 1970 by the hosts' ``clocks``."""

    number: int
    before: Look
    after: Look | None = None
    began: dict[str, float] = field(default_factory=dict)
    clocks: Mapping[str, Clock] = field(default_factory=dict)
    ended: float = 0.0
    systems: Mapping[str, System] = field(default_factory=dict)
    stops: list[RobotStop] = field(default_factory=list)
    outcome: str = "completed"
    cause: str = ""
    judged: list[Judged] = field(default_factory=list)

    @property
    def success(self) -> bool | None:
        """Whether it was completed, and its bags show what was wanted; None if nothing was."""
        met = all(one.met for one in self.judged)
        return self.outcome == "completed" and met if self.judged else None

    @property
    def skew(self) -> float | None:
        """S between the first and the last host's start, as far as their clocks are known."""
        moments = [moment - self.clocks[host].ahead for host, moment in self.began.items()]
        return max(moments) - min(moments) if moments else None

    @property
    def start(self) -> float:
        """When the first host started, or else the first look: s since 1970 by the operator's clock."""
        moments = [moment - self.clocks[host].ahead for host, moment in self.began.items()]
        return min(moments, default=self.before.began)

    def interrupt(self) -> None:
        """Makes it one that a person has ended."""
        self.outcome, self.cause = "interrupted", "ended by a person"

    def fail(self, cause: str) -> None:
        """Makes it a failed one; the first cause stays."""
        if self.outcome == "completed":
            self.outcome, self.cause = "failed", cause


class TrialHosts:
    """The hosts on which the trials of an experiment run."""

    def __init__(
        self,
        swarm: Swarm,
        experiment: Experiment,
        targets: Mapping[str, Target],
        connect: Callable[..., Transport],
        look: Looking,
        *,
        complete: Callable[[str], str],
        parallel: int,
    ) -> None:
        self._swarm, self._experiment = swarm, experiment
        self._targets, self._connect, self._look = targets, connect, look
        self._complete, self._parallel = complete, parallel
        robots = experiment.robots or tuple(swarm.robots)
        self._robots = _by_host((swarm.robots[one].host, one) for one in robots)
        self._all = self._targets, self._robots
        units = ((swarm.programs[one].host, names.unit(swarm.name, one)) for one in experiment.programs)
        self._units = _by_host(units)

    def run(self, number: int, folder: Path) -> Trial:
        """Runs a trial; ``folder`` gets its bags and logs. Raises ``TrialError`` if it cannot begin."""
        with interruptible():
            trial = self._ready(number)
            recording = self._recording()
            try:
                self._record(recording)
                self._start(trial)
                self._watch()
            except KeyboardInterrupt:
                trial.interrupt()
            except TrialError as error:
                trial.fail(str(error))
            finally:  # whatever it is that ends the trial
                with _signals(signal.SIG_IGN, signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                    trial.stops = list(self._stop())
            trial.ended = time.time()
            for one in trial.stops:
                if not _stood(one):
                    trial.fail(f"{one.robot}: {one.trouble}")
            try:
                trial.after = self._look()
                for trouble in trial_troubles.in_it(trial.before, trial.after, self._experiment.programs):
                    trial.fail(printable(trouble))
                if self._experiment.record:
                    self._fetch(recording, folder / "bags", trial)
                self._look_back(trial, folder / "logs")
            except (KeyboardInterrupt, typer.Exit):
                trial.interrupt()
        return trial

    def _fetch(self, recording: RecordingHosts, bags: Path, trial: Trial) -> None:
        recording.fetch(bags, self._complete(f"swarmctl record SPEC --fetch --out {bags}"))
        for host in recording.document()["hosts"]:
            if host["error"] or host["ended"] in ("disk", "failed", "lost"):
                why = host["error"]["message"] if host["error"] else f"ended: {host['ended']}"
                trial.fail(printable(f"the recording on {host['host']}: {why}"))

    def _look_back(self, trial: Trial, logs: Path) -> None:
        name, parallel = self._swarm.name, self._parallel
        error = max((one.error for one in trial.clocks.values()), default=0.0)
        trial_logs.fetch(
            name, self._targets, self._connect(), logs,
            began=trial.start - error, ended=trial.ended, parallel=parallel,
        )  # fmt: skip
        trial.systems = host_systems.systems(self._swarm, self._targets, self._connect(), parallel=parallel)

    def stand(self) -> None:
        """Stops the robots. Raises ``TrialError`` if one does not stand; optional hosts may be away."""
        self._targets, self._robots = self._all
        for one in self._stop():
            if not _stood(one) and not self._swarm.hosts[one.host].optional:
                raise TrialError(f"{one.robot} does not stand: {one.trouble}")

    def _ready(self, number: int) -> Trial:
        """Returns the trial once its robots stand, the swarm is healthy and no host has older bags."""
        self._targets, self._robots = self._all
        stops = list(self._stop())
        before, items = readiness_look.look(
            self._swarm, self._experiment, self._look, self._targets, self._connect(), self._parallel
        )
        if missing := next((one for one in items if not one.go), None):
            raise TrialError(printable(f"{missing.what}: {missing.text}"))
        away = {row.name for row in before.status.hosts if not row.reachable}  # optional ones: it is healthy
        for one in stops:
            if not _stood(one) and one.host not in away:
                raise TrialError(f"{one.robot} does not stand: {one.trouble}")
        self._leave_out(away)
        request = recording_verb.Request(self._swarm.name)
        wanted = dict.fromkeys(self._targets, request)
        states = ask_each(
            recording_verb.handle, wanted, self._targets, self._connect(), parallel=self._parallel
        )
        for host, state in _answers(states).items() if self._experiment.record else ():
            if state.runs or state.bags:
                what = "records already" if state.runs else "has bags of an earlier recording"
                raise TrialError(
                    self._complete(f"{host} {what}; `swarmctl record SPEC --fetch` fetches them")
                )
        return Trial(number, before)

    def _leave_out(self, away: Set[str]) -> None:
        """Goes on without optional hosts. Raises ``TrialError`` for one with a program of the experiment."""
        for host in away & self._units.keys():
            raise TrialError(f"{host} does not answer, and has a program of the experiment")
        for host in away & self._robots.keys():
            without = ", ".join(self._robots[host])
            console.show(f"{host} does not answer and is optional: a trial without {without}", error=True)
        self._targets = {host: one for host, one in self._targets.items() if host not in away}
        self._robots = {host: one for host, one in self._robots.items() if host not in away}
        if not self._robots and not self._units:
            raise TrialError("no host of the experiment answers")

    def _stop(self) -> Iterator[RobotStop]:
        began = time.monotonic()
        events = robot_stop.stop(
            self._swarm.name, self._robots, self._targets, self._connect(urgent=True),
            lambda: time.monotonic() - began, others=False, parallel=self._parallel,
        )  # fmt: skip
        for event in events:
            if isinstance(event, Finished):
                for one in robot_stop.robot_stops(event.host, self._robots[event.host], event.outcome):
                    if one.state != "stands" or one.seconds:
                        console.show(view.line(one), error=True)
                    yield one

    def _recording(self) -> RecordingHosts:
        targets = list(self._targets.values())
        return RecordingHosts(
            self._swarm, targets, self._connect(), self._complete, self._parallel, json=True
        )

    def _record(self, recording: RecordingHosts) -> None:
        if not self._experiment.record:
            return
        accounts = dict.fromkeys(self._swarm.hosts, "")  # no request is sent to those that are away
        accounts |= {name: target.user for name, target in self._targets.items()}
        seconds = self._experiment.duration + _LEAD + _SPARE
        wanted = requests(
            self._swarm, accounts, self._experiment.record, seconds=seconds, megabytes=_MEGABYTES
        )
        found = recording.start(wanted)
        if recording.exit_code() or not found:
            raise TrialError(
                "nothing publishes what `record` names" if not found else "a host does not record"
            )

    def _start(self, trial: Trial) -> None:
        """Lets all hosts start at one instant."""
        hosts = list(dict.fromkeys((*self._robots, *self._units)))
        targets = {host: self._targets[host] for host in hosts}
        name, transport = self._swarm.name, self._connect()
        found = _answers(trial_start.seen(name, targets, transport, parallel=len(hosts)))
        trial.clocks = {host: one.clock for host, one in found.items()}
        at, who = trial_start.instant(trial.clocks, _LEAD), operators.this_one()
        wanted = {
            host: trial_verb.Request(
                name,
                who,
                self._robots.get(host, []),
                self._units.get(host, []),
                at,
                self._experiment.duration,
            )
            for host in hosts
        }
        started = trial_start.start(wanted, targets, transport, parallel=len(hosts))
        results = results_of(started)
        answers = {host: one for host, one in results.items() if not isinstance(one, HostError)}
        trial.began = {host: one.began for host, one in answers.items() if one.deployed}
        _answers_of(results)
        for host in answers.keys() - trial.began.keys():
            raise TrialError(f"{host}: the swarm is not deployed to this host")

    def _watch(self) -> None:
        """Returns when the time of the trial is over. Raises ``TrialError`` if a robot was stopped before.

        A host that does not answer fails the trial at its end alone: the link may come back.
        """
        end, away = time.monotonic() + self._experiment.duration, ""
        due = max(self._experiment.duration - _LOOK, _LAST)  # s left at the next look at the hosts
        with console.err().status("") as progress:
            while (left := end - time.monotonic()) > 0:
                progress.update(f"{left:.0f} s left; Ctrl-C stops the robots")
                if left <= due:
                    away, due = self._away(end), max(due - _LOOK, _LAST) if due > _LAST else 0.0
                time.sleep(min(max(0.0, end - time.monotonic()), 0.2))
        if away:
            raise TrialError(away)

    def _away(self, end: float) -> str:
        """Which host does not answer before ``end``. Raises ``TrialError`` for a robot that was stopped."""
        targets = {host: self._targets[host] for host in self._robots}
        away, stopped = "", ""
        for event in trial_start.seen(self._swarm.name, targets, self._connect(), parallel=self._parallel):
            if not isinstance(event, Finished):
                continue
            if isinstance(event.outcome, HostError):
                away = away or _message(event.host, event.outcome)
            elif gone := [
                one for one in self._robots[event.host] if one not in event.outcome.answer.released
            ]:
                if time.monotonic() > end:
                    away = away or f"{event.host}: it did not answer before the end"
                else:
                    stopped = stopped or f"{gone[0]} was stopped before the end, or {event.host} restarted"
        if stopped:
            raise TrialError(stopped)
        return away


def _by_host(pairs: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for host, name in pairs:
        if name not in found.setdefault(host, []):
            found[host].append(name)
    return found


def _stood(one: RobotStop) -> bool:
    """True if the robot stands, or its wheels are not measured."""
    return one.state != "failed" and one.trouble != robot_motion.STILL_TURN


def interruptible() -> AbstractContextManager[None]:
    """Makes SIGTERM and SIGHUP, of a terminal that closes, a KeyboardInterrupt within the block."""
    return _signals(signal.default_int_handler, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def _signals(handler: Any, *numbers: signal.Signals) -> Iterator[None]:
    """Handles signals so within the block."""
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, one in before.items():
            signal.signal(number, one)


def _answers(events: Iterator[Event[R]]) -> dict[str, R]:
    """The answer of each host. Raises ``TrialError`` for the first error."""
    return _answers_of(results_of(events))


def _answers_of(results: Mapping[str, R | HostError]) -> dict[str, R]:
    for host, one in results.items():
        if isinstance(one, HostError):
            raise TrialError(_message(host, one))
    return {host: one for host, one in results.items() if not isinstance(one, HostError)}


def _message(host: str, error: HostError) -> str:
    return printable(f"{host}: {error.message.removeprefix(f'{host}: ')}")
