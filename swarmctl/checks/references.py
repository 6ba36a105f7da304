"""Every name that is used is a name that is defined."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix
from swarmctl.spec.edits import mend, replace_value
from swarmctl.spec.model import Bluetooth, NetworkLink, Serial
from swarmctl.spec.suggest import did_you_mean, nearest


def unknown_names(case: Case) -> Iterator[Diagnostic]:
    """REF001: a host, robot, robot type, computer or commander that the spec does not know."""
    spec = case.spec
    for name, robot in spec.robots.items():
        yield from _look_up(case, case.types, "robot type", robot.type, "robots", name, "type")
        if robot.host is not None:
            yield from _look_up(case, spec.hosts, "host", robot.host, "robots", name, "host")
    for name, host in spec.hosts.items():
        if host.computer is not None:
            yield from _look_up(case, case.computers, "computer", host.computer, "hosts", name, "computer")
        if host.via is not None:
            yield from _look_up(case, spec.hosts, "host", host.via, "hosts", name, "via")
    if (computer := spec.defaults.host.computer) is not None:
        yield from _look_up(case, case.computers, "computer", computer, "defaults", "host", "computer")
    for key in ("leader", "hub"):
        if (named := getattr(spec, key)) is not None:
            yield from _look_up(case, spec.hosts, "host", named, key)
    if spec.time.root is not None:
        yield from _look_up(case, spec.hosts, "host", spec.time.root, "time", "root")
    yield from _in_links(case)
    yield from _in_programs(case)
    commanders = {**spec.programs, **spec.robots, **spec.hosts}
    for index, control in enumerate(spec.control):
        yield from _look_up(case, commanders, "program, robot or host", control.by, "control", index, "by")
        for place, robot_name in enumerate(control.of):
            yield from _look_up(case, spec.robots, "robot", robot_name, "control", index, "of", place)


def circular_jumps(case: Case) -> Iterator[Diagnostic]:
    """REF002: a chain of `via` that comes back to where it began."""
    hosts = case.spec.hosts
    for name in hosts:
        passed = [name]
        while (step := hosts[passed[-1]].via) is not None and step in hosts and step not in passed:
            passed.append(step)
        if step == name:
            yield Diagnostic(
                "REF002",
                f"the way to host `{name}` goes in a circle: {' via '.join([*passed, name])}",
                case.span("hosts", name, "via"),
                help=("one host on the way must be reachable without `via`",),
            )


def _in_links(case: Case) -> Iterator[Diagnostic]:
    spec = case.spec
    for index, link in enumerate(spec.links):
        if isinstance(link, NetworkLink):
            for place, host in enumerate(link.hosts):
                yield from _look_up(case, spec.hosts, "host", host, "links", index, "hosts", place)
        elif isinstance(link, (Serial, Bluetooth)):
            yield from _look_up(case, spec.hosts, "host", link.host, "links", index, "host")
            yield from _look_up(case, spec.robots, "robot", link.robot, "links", index, "robot")


def _in_programs(case: Case) -> Iterator[Diagnostic]:
    spec = case.spec
    for name, program in spec.programs.items():
        if program.host is not None:
            yield from _look_up(case, spec.hosts, "host", program.host, "programs", name, "host")
        if program.robot is not None:
            yield from _look_up(case, spec.robots, "robot", program.robot, "programs", name, "robot")
    for name, island in spec.islands.items():
        for key in ("leader", "hub"):
            if (named := getattr(island, key)) is not None:
                yield from _look_up(case, spec.hosts, "host", named, "islands", name, key)
        for place, host in enumerate(island.hosts):
            yield from _look_up(case, spec.hosts, "host", host, "islands", name, "hosts", place)


def _look_up(
    case: Case, known: Mapping[str, Any], what: str, word: str, *loc: str | int
) -> Iterator[Diagnostic]:
    if word not in known:
        yield Diagnostic(
            "REF001",
            f"there is no {what} called `{word}`",
            case.span(*loc),
            label="not defined",
            help=did_you_mean(word, known, f"known {what}s"),
            fix=_nearest(case, known, word, loc),
        )


def _nearest(case: Case, known: Mapping[str, Any], word: str, loc: tuple[str | int, ...]) -> Fix | None:
    near = nearest(word, tuple(known))
    return mend(f"write `{near}`", replace_value(case.source, loc, near)) if near else None


NAMES: tuple[Rule, ...] = (unknown_names,)
RULES: tuple[Rule, ...] = (circular_jumps,)
