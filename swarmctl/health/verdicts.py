"""One look at one thing: what was expected, what was seen, and the verdict. Pure; looks at nothing else."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from urllib.parse import urlsplit

from swarmctl.health.expected import ExpectedHost, ExpectedRobot
from swarmctl.health.seen import DeviceSeen, MasterSeen, NodeSeen, Report, TopicSeen, UnitSeen
from swarmctl.topology.interfaces import COMMAND_TYPE, DriverTopic

LOWEST_SHARE = 0.7  # of the expected rate
MOST_RESTARTS = 3  # of a unit since it was started by hand or by a deploy
LARGEST_SKEW = 1.0  # s between a host's clock and its hub's; the measurement itself errs by some tenths
_PERIODS_TO_JUDGE = 2.0


class State(str, Enum):
    """How a thing is. ``skipped``: rightly not there, or not looked at; ``unknown``: not to be found out."""

    OK = "ok"
    SKIPPED = "skipped"
    WARNING = "warning"
    UNKNOWN = "unknown"
    BAD = "bad"


@dataclass(frozen=True)
class Verdict:
    state: State
    message: str
    hint: str = ""

    @property
    def fine(self) -> bool:
        return self.state is State.OK

    def bearable(self) -> Verdict:
        """The same for something that the swarm is complete without."""
        return replace(self, state=State.WARNING) if self.state is State.BAD else self


def ok(message: str) -> Verdict:
    return Verdict(State.OK, message)


def bad(message: str, hint: str = "") -> Verdict:
    return Verdict(State.BAD, message, hint)


def unknown(message: str) -> Verdict:
    return Verdict(State.UNKNOWN, message)


def release(host: ExpectedHost, seen: str | None) -> Verdict:
    """Another release is only a warning: what it breaks shows by itself, and robots may well drive on it."""
    if seen is None:
        return bad("nothing is deployed", "run swarmctl deploy")
    if seen != host.release.digest:
        text = f"runs {seen}, the spec renders {host.release.digest}"
        return Verdict(State.WARNING, text, "run swarmctl deploy")
    return ok(f"runs {seen}")


def clock(ahead: float) -> Verdict:
    """``ahead``: of the hub's clock, s."""
    if abs(ahead) <= LARGEST_SKEW:
        return ok("agrees with its hub's")
    side = "ahead of" if ahead > 0 else "behind"
    text = f"is {abs(ahead):.1f} s {side} its hub's: transforms and stamps go wrong"
    return Verdict(State.WARNING, text, "does chrony run on both? `chronyc sources` tells what a host hears")


def unit(name: str, host: str, seen: UnitSeen | None) -> Verdict:
    journal = f"on {host}: journalctl -u {name} -n 20"
    if seen is None:
        return unknown("was not asked about")
    if seen.load == "not-found":
        return bad("does not exist on the host", "run swarmctl deploy")
    if seen.sub == "auto-restart" or seen.restarted:
        return bad(f"crash loop: {_times(seen.restarts)}, last result {seen.result or 'unknown'}", journal)
    if seen.skipped:
        hint = f"on {host}: systemctl status {name}"
        return Verdict(State.SKIPPED, "a condition of the unit is not met on this host", hint)
    if seen.active == "failed":
        return bad(f"failed: {seen.result or 'unknown'}", journal)
    if seen.active == "activating":
        return Verdict(State.WARNING, _with("is starting", seen.text), journal)
    if not seen.runs:
        return bad(f"does not run ({seen.active or 'unknown'})", f"on {host}: systemctl start {name}")
    if seen.restarts >= MOST_RESTARTS:
        return Verdict(State.WARNING, f"{_times(seen.restarts)} since it was started", journal)
    return ok(_with("runs", seen.text))


def master(host: ExpectedHost, seen: MasterSeen | None, run_id: str = "") -> Verdict:
    """``run_id``: that of the master as its hub sees it, empty when that is not known."""
    if seen is None:
        return unknown("was not asked")
    if not seen.reachable:
        hint = f"check the way from {host.name} to {host.hub}: address, firewall, wireless client isolation"
        text = f"{host.master_uri} does not answer: {seen.error}"
        return bad(text, f"on {host.name}: systemctl status {host.master_unit}" if host.is_hub else hint)
    if run_id and seen.run_id != run_id:
        text = f"at {host.master_uri} sits another master than {host.hub}'s"
        return bad(text, "does a second machine have this address?")
    return ok(f"answers in {seen.latency * 1000:.1f} ms")


def device(robot: ExpectedRobot, seen: DeviceSeen | None) -> Verdict:
    if seen is None:
        return unknown(f"{robot.device} was not looked at")
    if not seen.exists:
        nearby = f"; adapters there: {', '.join(seen.nearby)}" if seen.nearby else ""
        return bad(f"{robot.device} is not there", f"connect {robot.adapter}{nearby}")
    if not seen.is_device:
        return bad(f"{robot.device} is not a serial device", "remove the file that stands in its place")
    if not seen.usable:
        text = f"{robot.device} is closed to drivers: group {seen.group}, mode {seen.mode:04o}"
        return bad(
            text, "it should be of group dialout with mode 0660; is there a udev rule that says otherwise?"
        )
    return ok(robot.device if seen.resolves in ("", robot.device) else f"{robot.device} ({seen.resolves})")


def driver(robot: ExpectedRobot, place: str, process: UnitSeen | None, seen: NodeSeen | None) -> Verdict:
    """``process``: the driver's unit; ``place``: what its host calls itself."""
    restart = f"on {robot.host}: systemctl restart {robot.unit}"
    if seen is None or seen.registered is None:
        return unknown(f"{robot.node} was not asked about")
    runs = process is not None and process.runs
    if not seen.registered:
        why = " although its unit runs: was the master restarted?" if runs else ""
        return bad(f"{robot.node} is not registered at the master{why}", restart)
    if not seen.alive:
        text = "is registered and its unit runs, but it" if runs else "is a stale registration: it"
        return bad(f"{robot.node} {text} does not answer ({seen.error})", restart)
    if (advertised := host_of(seen.uri)) != place.lower():
        text = f"{robot.node} tells others to reach it at {advertised}, not at {place}"
        return bad(
            text, "something overrides ROS_IP or ROS_HOSTNAME; run swarmctl deploy, then restart the unit"
        )
    if robot.command not in seen.hears:
        return bad(f"{robot.node} does not hear {robot.command}: orders are lost", restart)
    if seen.hears[robot.command] not in (COMMAND_TYPE, "*"):
        return bad(
            f"{robot.node} hears {robot.command} as {seen.hears[robot.command]}, not as {COMMAND_TYPE}"
        )
    own = process.pid if process is not None and robot.guarded else 0
    if own and seen.pid and own != seen.pid:
        text = f"{robot.node} is process {seen.pid}, its unit's is {own}: a second driver took the name"
        return Verdict(
            State.WARNING, text, f"on {robot.host}: end process {seen.pid}, then restart {robot.unit}"
        )
    return ok(f"{robot.node} runs")


def report(seen: Report) -> Verdict:
    """The driver's own word."""
    state = {0: State.OK, 1: State.WARNING}.get(seen.level, State.BAD)
    return Verdict(state, f"says: {seen.message}" if seen.message else "says nothing more")


def topic(wanted: DriverTopic, node: NodeSeen) -> Verdict:
    """Is it published, as what, and how often?"""
    published_as = node.publishes.get(wanted.name)
    seen = node.topics.get(wanted.name)
    if published_as is None:
        return bad("is not published")
    if wanted.type not in (published_as, seen.type if seen else ""):
        return bad(f"is of type {published_as}, not {wanted.type}")
    if seen is None:
        return unknown("was not listened to")
    if seen.error:
        return bad(f"cannot be heard: {seen.error}")
    return _rate(wanted, seen)


def _rate(wanted: DriverTopic, seen: TopicSeen) -> Verdict:
    if wanted.rate * seen.seconds < _PERIODS_TO_JUDGE and seen.rate is None:
        return Verdict(State.SKIPPED, f"comes too rarely to be measured in {seen.seconds:g} s")
    if seen.count == 0:
        return bad(f"no message in {seen.seconds:g} s, {wanted.rate:g} Hz expected")
    if seen.rate is None:
        return bad(f"one message in {seen.seconds:g} s, {wanted.rate:g} Hz expected")
    text = f"measured {seen.rate:.1f} Hz of {wanted.rate:g}"
    return ok(text) if seen.rate >= LOWEST_SHARE * wanted.rate else bad(text)


def _times(restarts: int) -> str:
    return f"restarted {restarts} time{'' if restarts == 1 else 's'}"


def _with(text: str, status: str) -> str:
    return f"{text}: {status}" if status else text


def host_of(uri: str) -> str:
    """The host in a node's URI, or all of what is none."""
    try:
        return urlsplit(uri).hostname or uri
    except ValueError:
        return uri
