"""One trial on the hosts: robots stand, start together, and stop with proof."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from swarm_onboard.agent import robot_motion
from swarm_onboard.agent.trial_units import SUCCESS
from swarm_onboard.agent.verbs import recording as recording_verb
from swarm_onboard.agent.verbs import trial as trial_verb

from swarmctl.cli import console, readiness_look, stop_signals, trial_logs
from swarmctl.cli.recording_hosts import RecordingHosts
from swarmctl.cli.trial import Trial, TrialError
from swarmctl.cli.trial_topics import LiveTopics, live
from swarmctl.deploy import host_systems, robot_stop, trial_start
from swarmctl.health import trial_troubles
from swarmctl.health.host_costs import between
from swarmctl.remote import operators
from swarmctl.remote.ask import ask_each
from swarmctl.remote.parallel_hosts import Event, Finished, R, results_of
from swarmctl.remote.transport import HostError, Target, Transport
from swarmctl.render.recording_requests import requests
from swarmctl.swarm import names
from swarmctl.views import robot_stop as view
from swarmctl.views.escape import printable

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.costs import Answer as Costs

    from swarmctl.cli.swarm_look import Looking
    from swarmctl.deploy.robot_stop import RobotStop
    from swarmctl.deploy.trial_start import Clock
    from swarmctl.spec.experiment_model import Experiment
    from swarmctl.swarm.resolved import Swarm

_LEAD = 4.0  # s in which all hosts get the request, and stop the programs
_MEGABYTES = 256  # of a bag
_LOOK = 10.0  # s between two looks at hosts in a trial
_LAST = 2.0  # s before its end: the last look
_SPARE = 30.0  # s that a recording goes on without its operator
_RESET = 600.0  # s for the program of `reset`
_POLL = 1.0  # s


class TrialHosts:
    """The hosts on which the trials of an experiment run; ``name``: of the experiment."""

    def __init__(
        self,
        swarm: Swarm,
        name: str,
        experiment: Experiment,
        targets: Mapping[str, Target],
        connect: Callable[..., Transport],
        look: Looking,
        *,
        complete: Callable[[str], str],
        parallel: int,
    ) -> None:
        self._swarm, self._name, self._experiment = swarm, name, experiment
        self._targets, self._connect, self._look = targets, connect, look
        self._complete, self._parallel = complete, parallel
        robots = experiment.robots or tuple(swarm.robots)
        self._robots = _by_host((swarm.robots[one].host, one) for one in robots)
        self._all = self._targets, self._robots
        self._units = self._of_programs(one for one in experiment.programs if not self._waits(one))
        self._once = self._of_programs(filter(self._waits, experiment.programs))

    def _waits(self, program: str) -> bool:
        return self._swarm.programs[program].declared.lifecycle == "trial"

    def _of_programs(self, programs: Iterable[str]) -> dict[str, list[str]]:
        """The units of programs, by host."""
        pairs = ((self._swarm.programs[one].host, names.unit(self._swarm.name, one)) for one in programs)
        return _by_host(pairs)

    def run(self, number: int, folder: Path) -> Trial:
        """Runs a trial; ``folder`` gets its bags and logs. Raises ``TrialError`` if it cannot begin."""
        with stop_signals.as_interrupt():
            trial = self._ready(number)
            recording = self._recording()
            try:
                self._record(recording)
                with self._live() as topics:
                    self._start(trial)
                    topics.begin()
                    self._watch(trial, topics)
            except KeyboardInterrupt:
                trial.interrupt()
            except TrialError as error:
                trial.fail(str(error))
            finally:  # whatever it is that ends the trial
                with stop_signals.ignored():
                    trial.stops = list(self._stop())
                    for trouble in self._end(self._once):
                        trial.fail(trouble)
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
                self._look_back(trial, folder)
            except (KeyboardInterrupt, typer.Exit):
                trial.interrupt()
        return trial

    def _fetch(self, recording: RecordingHosts, bags: Path, trial: Trial) -> None:
        recording.fetch(bags, self._complete(f"swarmctl record SPEC --fetch --out {bags}"))
        for host in recording.document()["hosts"]:
            if host["error"] or host["ended"] in ("disk", "failed", "lost"):
                why = host["error"]["message"] if host["error"] else f"ended: {host['ended']}"
                trial.fail(printable(f"the recording on {host['host']}: {why}"))

    def _look_back(self, trial: Trial, folder: Path) -> None:
        name, parallel = self._swarm.name, self._parallel
        error = max((one.error for one in trial.clocks.values()), default=0.0)
        began, ended = trial.start - error, trial.ended
        trial_logs.fetch(
            name, self._targets, self._connect(), folder / "logs", began=began, ended=ended, parallel=parallel
        )
        trial_logs.fetch_commands(
            name, self._targets, self._connect(), folder / "commands.json", began=began, ended=ended,
            ahead={host: one.ahead for host, one in trial.clocks.items()}, parallel=parallel,
        )  # fmt: skip
        trial.systems = host_systems.systems(self._swarm, self._targets, self._connect(), parallel=parallel)

    def stand(self) -> None:
        """Stops the robots. Raises ``TrialError`` if one does not stand; optional hosts are left out."""
        self._targets, self._robots = self._all
        away = set()
        for one in self._stop():
            if _stood(one):
                continue
            if not self._swarm.hosts[one.host].optional:
                raise TrialError(f"{one.robot} does not stand: {one.trouble}")
            away.add(one.host)
        self._leave_out(away)

    def reset(self) -> None:
        """Runs the program of `reset`, with the robots released, until it ends. Raises ``TrialError``."""
        name = self._experiment.reset or ""
        units = self._of_programs([name])
        [(host, [unit])] = units.items()
        self.stand()
        running = self._of_programs([*filter(self._waits, self._experiment.programs), name])
        if troubles := list(self._end(running, failures=False)):
            raise TrialError(troubles[0])
        with stop_signals.as_interrupt():
            try:
                end = time.monotonic() + _RESET
                _require_started(self._begin(f"{self._name}, reset", {}, units, _RESET)[1])
                with console.err().status(f"program {name} resets the robots; Ctrl-C stops them"):
                    while True:
                        time.sleep(_POLL)
                        away, answers = self._seen({**self._robots, host: []}, end)
                        if host in answers and unit in answers[host].ended:
                            break
                        if time.monotonic() > end:
                            raise TrialError(away or f"program {name} did not end within {_RESET:g} s")
            finally:
                with stop_signals.ignored():
                    stops, troubles = list(self._stop()), list(self._end(units))
        if troubles := [f"{one.robot}: {one.trouble}" for one in stops if not _stood(one)] + troubles:
            raise TrialError(troubles[0])

    def _end(self, units: Mapping[str, list[str]], *, failures: bool = True) -> Iterator[str]:
        """Ends programs that run in trials alone; yields why one may run on, and ``failures`` of others."""
        wanted = {
            host: trial_verb.Request(self._swarm.name, operators.this_one(), [], [], of_host, 0.0, 0.0)
            for host, of_host in units.items()
            if host in self._targets
        }
        targets = {host: self._targets[host] for host in wanted}
        ended = ask_each(
            trial_verb.handle, wanted, targets, self._connect(urgent=True), parallel=self._parallel
        )
        for host, one in results_of(ended).items():
            if isinstance(one, HostError):
                yield _message(host, one)
            elif failures:
                yield from _failures(host, one)

    def _ready(self, number: int) -> Trial:
        """Returns the trial once its robots stand, the swarm is healthy and no host has older bags."""
        self._targets, self._robots = self._all
        stops = list(self._stop())
        list(self._end(self._once))  # of a trial whose operator was killed
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
        for host in away & {*self._units, *self._once}:
            raise TrialError(f"{host} does not answer, and has a program of the experiment")
        for host in away & self._robots.keys():
            without = ", ".join(self._robots[host])
            console.show(f"{host} does not answer and is optional: a trial without {without}", error=True)
        self._targets = {host: one for host, one in self._targets.items() if host not in away}
        self._robots = {host: one for host, one in self._robots.items() if host not in away}
        if not self._robots and not self._units and not self._once:
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

    def _live(self) -> AbstractContextManager[LiveTopics]:
        """The topics of `until`."""
        transport = self._connect(become=False)
        return live(self._swarm, self._experiment.until, self._targets, transport)

    def _start(self, trial: Trial) -> None:
        name, seconds = f"{self._name}, trial {trial.number}", self._experiment.duration
        trial.clocks, results = self._begin(name, self._units, self._once, seconds)
        answers = {host: one for host, one in results.items() if not isinstance(one, HostError)}
        trial.began = {host: one.began for host, one in answers.items() if one.deployed}
        _require_started(results)

    def _begin(
        self, name: str, units: Mapping[str, list[str]], once: Mapping[str, list[str]], seconds: float
    ) -> tuple[dict[str, Clock], dict[str, trial_verb.Answer | HostError]]:
        """Lets all hosts start at one instant; returns their clocks and answers. Raises ``TrialError``."""
        robots = self._robots
        hosts = list(dict.fromkeys((*robots, *units, *once)))
        targets = {host: self._targets[host] for host in hosts}
        swarm, transport = self._swarm.name, self._connect()
        found = _answers(trial_start.seen(swarm, targets, transport, parallel=len(hosts)))
        clocks = {host: one.clock for host, one in found.items()}
        at, who = trial_start.instant(clocks, _LEAD), operators.this_one()
        wanted = {
            host: trial_verb.Request(
                swarm, who, robots.get(host, []), units.get(host, []), once.get(host, []), at, seconds, name
            )
            for host in hosts
        }
        return clocks, results_of(trial_start.start(wanted, targets, transport, parallel=len(hosts)))

    def _watch(self, trial: Trial, topics: LiveTopics) -> None:
        """Returns when the time of the trial is over, or its topics show what ends it.

        Raises ``TrialError`` if a robot was stopped before, or a host cannot show a topic.
        A host that does not answer fails the trial at its end alone: the link may come back.
        """
        end, away = time.monotonic() + self._experiment.duration, ""
        due = self._experiment.duration  # s left at the next look at the hosts
        before: dict[str, Costs] = {}
        with console.err().status("") as progress:
            while (left := end - time.monotonic()) > 0:
                progress.update(f"{left:.0f} s left; Ctrl-C stops the robots")
                if topics.trouble:
                    raise TrialError(printable(f"`until`: {topics.trouble}"))
                if topics.met:
                    return
                if left <= due:
                    away = self._away(trial, end, before)
                    due = max(due - _LOOK, _LAST) if due > _LAST else 0.0
                time.sleep(min(max(0.0, end - time.monotonic()), 0.2))
        if away:
            raise TrialError(away)

    def _away(self, trial: Trial, end: float, before: dict[str, Costs]) -> str:
        """Which host does not answer before ``end``. ``before``: what units had taken at the first look.

        Raises ``TrialError`` for a robot that was stopped, and a program that has failed.
        """
        away, answers = self._seen({**self._robots, **self._units, **self._once}, end)
        for host, answer in answers.items():
            if answer.costs is not None:
                first = before.setdefault(host, answer.costs)
                trial.costs[host] = between(host, self._swarm.name, first, answer.costs)
        return away

    def _seen(self, hosts: Iterable[str], end: float) -> tuple[str, dict[str, trial_verb.Answer]]:
        """Which host does not answer before ``end``, and the answers of the others. Raises ``TrialError``."""
        targets = {host: self._targets[host] for host in hosts}
        seen = trial_start.seen(self._swarm.name, targets, self._connect(), parallel=self._parallel)
        away, stopped, answers = "", "", dict[str, trial_verb.Answer]()
        for event in seen:
            if not isinstance(event, Finished):
                continue
            if isinstance(event.outcome, HostError):
                away = away or _message(event.host, event.outcome)
                continue
            answer = answers[event.host] = event.outcome.answer
            stopped = stopped or next(_failures(event.host, answer), "")
            if gone := [one for one in self._robots.get(event.host, ()) if one not in answer.released]:
                if time.monotonic() > end:
                    away = away or f"{event.host}: it did not answer before the end"
                else:
                    stopped = stopped or f"{gone[0]} was stopped before the end, or {event.host} restarted"
        if stopped:
            raise TrialError(stopped)
        return away, answers


def _failures(host: str, answer: trial_verb.Answer) -> Iterator[str]:
    """Which programs that run in trials alone have ended with an error."""
    failed = (unit for unit, result in answer.ended.items() if result != SUCCESS)
    return (printable(f"{unit} on {host} failed: {answer.ended[unit]}") for unit in failed)


def _by_host(pairs: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for host, name in pairs:
        if name not in found.setdefault(host, []):
            found[host].append(name)
    return found


def _stood(one: RobotStop) -> bool:
    """True if the robot stands, or its wheels are not measured."""
    return one.state != "failed" and one.trouble != robot_motion.STILL_TURN


def _require_started(results: Mapping[str, trial_verb.Answer | HostError]) -> None:
    """Raises ``TrialError`` for a host that did not start."""
    for host, one in _answers_of(results).items():
        if not one.deployed:
            raise TrialError(f"{host}: the swarm is not deployed to this host")


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
