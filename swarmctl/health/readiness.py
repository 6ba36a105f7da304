"""Whether a trial can begin: what a look at the swarm and the thresholds of `ready` say. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from swarmctl.health.root_cause import HOST, Finding
from swarmctl.health.swarm_health import Look
from swarmctl.health.verdict import State
from swarmctl.spec.experiment_model import Ready

_HOSTS, _RELEASE, _CLOCKS = "hosts", "release", "clocks"
_OTHER = "other checks"
_PARTS = {
    HOST: _HOSTS, "probed": _HOSTS, "probe": _HOSTS, "systemd": _HOSTS, "release": _RELEASE, "clock": _CLOCKS,
    "unit": "units", "device": "devices", "driver": "drivers", "gate": "drivers", "robot": "drivers",
    "program": "programs", "topic": "topics", "publisher": "topics", "subscription": "topics",
}  # fmt: skip
_NEEDED = (_RELEASE, _CLOCKS)  # warnings elsewhere: a trial is of this spec, and starts at one instant
_MB = 1_000_000


class Measured(NamedTuple):
    """What is measured before a trial.

    By host: by how much its clock is ahead of this machine's, and how wrong that may be, s; bytes that are
    free for bags. By robot with a battery: how full that is, 0 to 1, or None. ``missing``: hosts that were
    looked at and not measured. ``low``: below which the battery of a robot is low by its settings.
    """

    clocks: Mapping[str, tuple[float, float]]
    free: Mapping[str, int]
    batteries: Mapping[str, float | None]
    missing: Sequence[str] = ()
    low: Mapping[str, float] = MappingProxyType({})


class Item(NamedTuple):
    """A line of the table: what is looked at, whether a trial can begin with it, and why."""

    what: str
    go: bool
    text: str


def items(look: Look, measured: Measured, wanted: Ready, programs: Collection[str]) -> list[Item]:
    """Returns what a trial that starts ``programs`` needs, each with a verdict."""
    found = {one.what: one for one in _of_status(look, programs)}
    for one in _of_measured(measured, wanted):
        if one.what not in found or found[one.what].go:
            found[one.what] = one
    return list(found.values())


def _of_status(look: Look, programs: Collection[str]) -> Iterator[Item]:
    findings = look.status.diagnosis.findings
    troubles = {one.key for one in look.status.diagnosis.troubles}
    wrong: dict[str, str] = {}
    for cause, symptoms in look.status.causes():
        part = _PARTS.get(cause.check, _OTHER)
        if part in _NEEDED or any(one.key in troubles for one in (cause, *symptoms)):
            wrong.setdefault(part, f"{cause.key}: {cause.message}")
    for one in findings:
        if one.check == "program" and one.state is State.SKIPPED and one.program in programs:
            wrong.setdefault("programs", f"program {one.program} {one.message}")
    parts: dict[str, list[Finding]] = {}
    for one in findings:
        parts.setdefault(_PARTS.get(one.check, _OTHER), []).append(one)
    for part in dict.fromkeys((*_PARTS.values(), _OTHER)):
        if part in wrong:
            yield Item(part, False, wrong[part])
        elif part in parts:
            yield Item(part, True, _counted(parts[part]))


def _counted(findings: Sequence[Finding]) -> str:
    count = Counter(one.state for one in findings)
    others = [f"{count[one]} {one.value}" for one in State if one is not State.OK and count[one]]
    return ", ".join([f"{count[State.OK]} of {len(findings)}", *others])


def _of_measured(measured: Measured, wanted: Ready) -> Iterator[Item]:
    if measured.missing and (wanted.clocks is not None or wanted.free_mb is not None):
        yield Item(_HOSTS, False, f"{measured.missing[0]} shows neither its clock nor its free space")
    if len(measured.clocks) > 1:
        yield _clocks(measured.clocks, wanted.clocks)
    if measured.free:
        host = min(measured.free, key=measured.free.__getitem__)
        free = measured.free[host] / _MB
        enough = wanted.free_mb is None or free >= wanted.free_mb
        least = "" if enough else f", less than {wanted.free_mb}"
        yield Item("disk", enough, f"{free:.0f} MB free on {host}{least}")
    if measured.batteries:
        of_all = wanted.battery
        low = measured.low if of_all is None else dict.fromkeys(measured.batteries, of_all)
        yield _batteries(measured.batteries, low)


def _clocks(clocks: Mapping[str, tuple[float, float]], most: float | None) -> Item:
    """Whether clocks are ``most`` s apart; more only where the errors of the measurement leave no doubt."""
    if most is not None:
        ahead = max(clocks, key=lambda host: clocks[host][0] - clocks[host][1])
        behind = min(clocks, key=lambda host: sum(clocks[host]))
        if (clocks[ahead][0] - clocks[ahead][1]) - sum(clocks[behind]) > most:
            text = f"{_apart(clocks, behind, ahead)}, more than {1000 * most:.0f}"
            return Item(_CLOCKS, False, text)
    order = sorted(clocks, key=lambda host: clocks[host][0])
    return Item(_CLOCKS, True, _apart(clocks, order[0], order[-1]))


def _apart(clocks: Mapping[str, tuple[float, float]], behind: str, ahead: str) -> str:
    (one, one_error), (other, other_error) = clocks[behind], clocks[ahead]
    error = one_error + other_error
    return f"{1000 * (other - one):.0f} ms between {behind} and {ahead}, give or take {1000 * error:.0f}"


def _batteries(batteries: Mapping[str, float | None], least: Mapping[str, float]) -> Item:
    known = {robot: one for robot, one in batteries.items() if one is not None}
    low = {robot: f" (less than {least[robot]:.0%})" for robot in known if known[robot] < least.get(robot, 0)}
    unknown = sorted((one for one in batteries if one not in known), key=lambda one: one not in least)
    emptiest = sorted(known, key=lambda one: (one not in low, known[one]))
    shown = [f"{robot} {known[robot]:.0%}{low.get(robot, '')}" for robot in emptiest[:3]]
    text = ", ".join([*shown, *(f"{robot} not known" for robot in unknown[:3])])
    return Item("batteries", not low and not any(one in least for one in unknown), text)
