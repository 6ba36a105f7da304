"""Single checks: each compares one expected thing with what was observed and returns a verdict. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from urllib.parse import urlsplit

from swarmctl.health import unit_conditions
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot
from swarmctl.health.observations import (
    DeviceSeen,
    LoadSeen,
    MasterSeen,
    NodeSeen,
    Report,
    TopicSeen,
    UnitSeen,
)
from swarmctl.swarm.topics import DriverTopic

LOWEST_SHARE = 0.7  # of the expected rate
MOST_RESTARTS = 3  # of a unit; one more within RESTART_WINDOW makes it unhealthy
RESTART_WINDOW = 600.0  # s; a start by hand or by a deploy begins a new count
_LONGEST_START = 10.0  # s
_NO_MAIN_PROCESS = ("dead", "failed", "auto-restart", "start-pre")  # sub states of a service
_PERIODS_TO_JUDGE = 2.0
_BUSY = 0.9  # of the time of all processors
_MOST_NAMED = 3


class State(str, Enum):
    """``skipped``: absent as intended, or not checked; ``unknown``: could not be determined."""

    OK = "ok"
    SKIPPED = "skipped"
    WARNING = "warning"
    UNKNOWN = "unknown"
    BAD = "bad"


@dataclass(frozen=True)
class Verdict:
    """The result of a check, with a hint how to fix what is wrong."""

    state: State
    message: str
    hint: str = ""

    @property
    def fine(self) -> bool:
        """True if the check passed."""
        return self.state is State.OK

    def bearable(self) -> Verdict:
        """Returns the same verdict for an optional part: a warning instead of bad."""
        return replace(self, state=State.WARNING) if self.state is State.BAD else self


def ok(message: str) -> Verdict:
    """Returns a verdict without problems."""
    return Verdict(State.OK, message)


def bad(message: str, hint: str = "") -> Verdict:
    """Returns a verdict that makes the swarm unhealthy."""
    return Verdict(State.BAD, message, hint)


def warning(message: str, hint: str = "") -> Verdict:
    """Returns a verdict that is shown, and leaves the swarm healthy."""
    return Verdict(State.WARNING, message, hint)


def unknown(message: str) -> Verdict:
    """Returns the verdict for a host without an answer."""
    return Verdict(State.UNKNOWN, message)


def release(host: ExpectedHost, seen: str | None) -> Verdict:
    """Compares the release. Another one is only a warning: robots may well drive with it."""
    if seen is None:
        return bad("nothing is deployed", "run swarmctl deploy")
    if seen != host.release.digest:
        text = f"runs {seen}, the spec renders {host.release.digest}"
        return Verdict(State.WARNING, text, "run swarmctl deploy")
    return ok(f"runs {seen}")


def unit(name: str, host: str, seen: UnitSeen | None) -> Verdict:
    """Checks that a systemd unit runs, that no process of it is stopped, and that it keeps running."""
    journal = f"on {host}: sudo journalctl -u {name} -n 50"
    if seen is None:
        return unknown("was not checked")
    if seen.load == "not-found":
        return bad("does not exist on the host", "run swarmctl deploy")
    if (troubled := _troubled(name, host, seen, journal)) is not None:
        return troubled
    if seen.skipped:
        why, hint = unit_conditions.explained(host, name, seen.unmet)
        return Verdict(State.SKIPPED, f"is skipped: {why}", hint)
    if seen.active == "failed":
        return bad(f"failed: {_ending(seen)}{_log(seen)}", journal)
    if seen.active == "activating" and seen.starting > _LONGEST_START:
        return bad(f"has been starting for {seen.starting:.0f} s{_log(seen)}", journal)
    if seen.active == "activating":
        return Verdict(State.WARNING, _with("is starting", seen.text), journal)
    if not seen.runs:
        return bad(f"does not run ({seen.active or 'unknown'})", f"on {host}: sudo systemctl start {name}")
    if (restarts := seen.restarts - seen.rejoined) >= MOST_RESTARTS:
        text = f"{_times(restarts)} since it was started{_running(seen)}"
        return Verdict(State.WARNING, text, journal)
    return ok(_with("runs", seen.text))


def _troubled(name: str, host: str, seen: UnitSeen, journal: str) -> Verdict | None:
    """Checks what a unit that runs may hide: stopped processes, and restarts one after the other."""
    if seen.stopped:
        numbers = " ".join(one.partition(" ")[0] for one in seen.stopped)
        text = f"a signal has stopped its process{'es' if len(seen.stopped) > 1 else ''} "
        return bad(text + ", ".join(seen.stopped), f"on {host}: sudo kill -CONT {numbers}")
    if seen.restarted or (seen.active == "activating" and seen.restarts) or seen.sub == "auto-restart":
        what = f"crash loop: {_times(seen.restarts)}" if seen.restarts else "ended and is started again"
        return bad(f"{what}, last result {_ending(seen)}{_log(seen)}", journal)
    if seen.recent > MOST_RESTARTS:
        text = f"{_times(seen.recent)} within {RESTART_WINDOW / 60:g} min, last result {_ending(seen)}"
        reset = f"once it is fixed: sudo systemctl reset-failed {name}"
        return bad(text + _running(seen), f"{journal}; {reset}")
    return None


def master(
    host: ExpectedHost, seen: MasterSeen | None, run_id: str = "", process: UnitSeen | None = None
) -> Verdict:
    """Checks the master as ``host`` reaches it.

    ``run_id``: of the master as its hub sees it, or empty; ``process``: the unit of the master on its hub.
    """
    if seen is None:
        return unknown("was not checked")
    if not seen.reachable:
        hint = f"check the route from {host.name} to {host.hub}: address, firewall, wireless client isolation"
        text = f"{host.master_uri} does not answer: {seen.error}"
        return bad(text, f"on {host.name}: systemctl status {host.master_unit}" if host.is_hub else hint)
    if is_foreign(seen, process):
        port = urlsplit(host.master_uri or "").port
        text = f"another master answers at {host.master_uri}: that of {host.hub} does not run"
        log = _log(process) if process is not None else ""
        return bad(text + log, f"on {host.hub}, to find it: sudo ss -ltnp sport = :{port}")
    if not seen.run_id:
        text = f"{host.master_uri} answers, and has lost its parameters: /run_id is not set"
        return bad(text, f"on {host.name}: sudo systemctl restart {host.master_unit}" if host.is_hub else "")
    if run_id and seen.run_id != run_id:
        text = f"another master than that of {host.hub} answers at {host.master_uri}"
        return bad(text, "check whether a second machine has this address")
    return ok(f"answers in {seen.latency * 1000:.1f} ms")


def is_foreign(seen: MasterSeen | None, process: UnitSeen | None) -> bool:
    """Returns True if a master answers, and not that of the unit ``process``, which does not run."""
    answers = seen is not None and seen.reachable
    return answers and process is not None and process.sub in _NO_MAIN_PROCESS and not process.skipped


def device(robot: ExpectedRobot, seen: DeviceSeen | None) -> Verdict:
    """Checks that the robot's serial device exists and that drivers may open it."""
    if seen is None:
        return unknown(f"{robot.device} was not checked")
    if not seen.exists:
        nearby = f"; connected adapters: {', '.join(seen.nearby)}" if seen.nearby else ""
        return bad(f"{robot.device} does not exist", f"connect {robot.adapter}{nearby}")
    if not seen.is_device:
        return bad(f"{robot.device} is not a serial device", "remove the file at this path")
    if not seen.usable:
        text = f"{robot.device} cannot be opened by drivers: group {seen.group}, mode {seen.mode:04o}"
        return bad(text, "it needs group dialout and mode 0660; check for another udev rule that sets them")
    return ok(robot.device if seen.resolves in ("", robot.device) else f"{robot.device} ({seen.resolves})")


def absent(host: ExpectedHost) -> str:
    """Returns the text for a node of ``host`` that the graph does not have."""
    return "is not registered at the master" if host.master_uri else "is not in the graph"


def dead(host: ExpectedHost, seen: NodeSeen) -> str:
    """Returns the text for a node of ``host`` that the graph has, but that is not alive."""
    silent = f"does not answer ({seen.error})"
    return f"is registered, but {silent}" if host.master_uri else silent


def moved(host: ExpectedHost, seen: NodeSeen) -> str:
    """The text for a node that advertises another address than ``host``; empty if it does not.

    Nodes of a middleware whose probe reports no URIs advertise nothing.
    """
    if seen.uri and (advertised := host_of(seen.uri)) != host.advertised.lower():
        return f"advertises {advertised} instead of {host.advertised}"
    return ""


def driver(
    robot: ExpectedRobot, host: ExpectedHost, process: UnitSeen | None, seen: NodeSeen | None
) -> Verdict:
    """Checks the driver's node on ``host``. ``process``: its unit."""
    restart = f"on {robot.host}: sudo systemctl restart {robot.unit}"
    if seen is None or seen.registered is None:
        return unknown(_unchecked(robot.node, seen))
    runs = process is not None and process.runs
    if not seen.registered:
        if process is not None and runs and process.recent:
            text = f"{robot.node} {absent(host)}: its unit was {_times(process.recent)}, last result"
            return bad(
                f"{text} {_ending(process)}", f"on {robot.host}: sudo journalctl -u {robot.unit} -n 50"
            )
        why = " although its unit runs" if runs else ""
        why += "; the master may have been restarted" if runs and host.master_uri else ""
        return bad(f"{robot.node} {absent(host)}{why}", restart)
    if not seen.alive and host.master_uri:
        text = "is registered and its unit runs, but it" if runs else "is a stale registration: it"
        return bad(f"{robot.node} {text} does not answer ({seen.error})", restart)
    if not seen.alive:
        return bad(f"{robot.node} {dead(host, seen)}", restart)
    if other := moved(host, seen):
        hint = "ROS_IP or ROS_HOSTNAME is overridden; run swarmctl deploy, then restart the unit"
        return bad(f"{robot.node} {other}", hint if host.master_uri else restart)
    command, wanted = robot.takes
    if command and command not in seen.subscribes:
        lost = "commands are lost" if robot.gate is None else "no command that passes the gate reaches it"
        return bad(f"{robot.node} does not subscribe to {command}: {lost}", restart)
    if command and (kind := seen.subscribes[command]) not in (wanted, "*"):
        return bad(f"{robot.node} subscribes to {command} as {kind} instead of {wanted}")
    own = process.pid if process is not None and robot.guarded else 0
    if own and seen.pid and own != seen.pid:
        text = f"{robot.node} is process {seen.pid}, but its unit runs {own}: a second driver has its name"
        return Verdict(
            State.WARNING, text, f"on {robot.host}: sudo kill {seen.pid}; sudo systemctl restart {robot.unit}"
        )
    return ok(f"{robot.node} runs")


def _unchecked(node: str, seen: NodeSeen | None) -> str:
    return f"{node} was not checked" + (f": {seen.error}" if seen is not None and seen.error else "")


def environment(host: str, unit: str, differences: Sequence[str]) -> Verdict:
    """Checks the ROS variables of the process of a unit. ``differences`` from the release, in words."""
    if not differences:
        return ok("is that of the release")
    hint = f"on {host}, for what overrides it: systemctl cat {unit}; then: sudo systemctl restart {unit}"
    return bad(f"{listed(differences)}: a drop-in sets it, or the unit runs from before", hint)


def parameters(robot: ExpectedRobot, seen: NodeSeen) -> Verdict:
    """Checks the parameters that the driver has set, for nodes that read them when they start."""
    if not seen.parameters:
        return ok("are as the driver set them")
    restart = f"on {robot.host}, to set them again: sudo systemctl restart {robot.unit}"
    return bad(f"of {robot.node}: {listed(seen.parameters)}", restart)


def report(seen: Report) -> Verdict:
    """Returns the state that the driver reports in /diagnostics."""
    state = {0: State.OK, 1: State.WARNING}.get(seen.level, State.BAD)
    return Verdict(state, seen.message or "reports no details")


def load(seen: LoadSeen, host: str) -> Verdict:
    """Checks whether the processes of a host leave time of its processors."""
    if seen.busy < _BUSY or seen.own < _BUSY / 2:
        return ok("has time left")
    text = f"its processes take {seen.own:.0%} of the time of its processors"
    return warning(f"{text}, most of it {listed(seen.busiest)}", f"on {host}: top")


def topic(wanted: DriverTopic, node: NodeSeen, load: LoadSeen | None = None) -> Verdict:
    """Checks that a topic is published, its type and its rate.

    ``load``: of its host. A host with much to do slows down its nodes, and what status looks with: then a low
    rate is a warning, and silence is none.
    """
    published_as = node.publishes.get(wanted.name)
    seen = node.topics.get(wanted.name)
    if published_as is None:
        return bad("is not published")
    if wanted.type not in (published_as, seen.type if seen else ""):
        return bad(f"has type {published_as} instead of {wanted.type}")
    if not wanted.rate:
        return ok("is published")
    if seen is None:
        return unknown("was not measured")
    if seen.error:
        return bad(f"cannot be received: {seen.error}")
    return _rate(wanted, seen, load)


def too_slow(wanted: DriverTopic, seen: TopicSeen) -> bool:
    """Returns True if the probe listened for too short a time to measure the rate."""
    return seen.rate is None and (not seen.seconds or 0 < wanted.rate * seen.seconds < _PERIODS_TO_JUDGE)


def _rate(wanted: DriverTopic, seen: TopicSeen, load: LoadSeen | None) -> Verdict:
    if too_slow(wanted, seen):
        return Verdict(State.SKIPPED, f"is too slow to be measured in {seen.seconds:g} s")
    if seen.count == 0:
        return bad(f"no message in {seen.seconds:g} s, {wanted.rate:g} Hz expected")
    if seen.rate is None:
        return bad(f"one message in {seen.seconds:g} s, {wanted.rate:g} Hz expected")
    text = f"measured {seen.rate:.1f} Hz of {wanted.rate:g}"
    if seen.rate >= LOWEST_SHARE * wanted.rate:
        return ok(text)
    if seen.age is not None and seen.age * wanted.rate > _PERIODS_TO_JUDGE:
        return bad(f"{text}, the last message {seen.age:.1f} s ago")
    if load is not None and load.busy >= _BUSY:
        text = f"{text}, while the processors of its host were busy ({load.busy:.0%})"
        return warning(text, "`top` on the host shows what keeps them busy")
    return bad(text)


def listed(texts: Sequence[str]) -> str:
    """Returns the texts with commas between them; of many the first three, and how many more there are."""
    more = [f"{len(texts) - _MOST_NAMED} more"] if len(texts) > _MOST_NAMED else []
    return ", ".join([*texts[:_MOST_NAMED], *more])


def _ending(seen: UnitSeen) -> str:
    """How the unit ended: systemd's result, which is ``success`` while it runs again, and the exit code."""
    known = [one for one in (seen.result, seen.exit) if one and not (seen.exit and one == "success")]
    return ", ".join(known) or "unknown"


def _log(seen: UnitSeen) -> str:
    """The end of the log of a unit that does not run."""
    return f"; its log ends with: {seen.log}" if seen.log and not seen.runs else ""


def _times(restarts: int) -> str:
    return f"restarted {restarts} time{'' if restarts == 1 else 's'}"


def _running(seen: UnitSeen) -> str:
    """For how long a restarted unit has run by now, in s, min or h, rounded down."""
    if not seen.runs or seen.running < 1:
        return ""
    for unit, seconds in (("h", 3600), ("min", 60)):
        if seen.running >= 2 * seconds:
            return f"; it has run for {seen.running // seconds:.0f} {unit} now"
    return f"; it has run for {seen.running:.0f} s now"


def _with(text: str, status: str) -> str:
    return f"{text}: {status}" if status else text


def host_of(uri: str) -> str:
    """Returns the host in a node's URI, or the whole text if it is not a URI."""
    try:
        return urlsplit(uri).hostname or uri
    except ValueError:
        return uri
