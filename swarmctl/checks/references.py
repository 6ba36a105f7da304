"""Every name that is used is a name that is defined."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note, Severity
from swarmctl.spec.edits import mend, remove, replace_value
from swarmctl.spec.model import Bluetooth, NetworkLink, Serial, Spec
from swarmctl.spec.source import Loc
from swarmctl.spec.suggest import did_you_mean, nearest

Named = tuple[str | None, Loc]  # a name, if one is said, and where it stands
_SHOWN = 5  # hosts on a way that goes in a circle


def unknown_names(case: Case) -> Iterator[Diagnostic]:
    """REF001: a host, robot, robot type, computer or commander that the spec does not know."""
    spec = case.spec
    yield from _unknown(case, "robot type", case.types, _types(spec))
    yield from _unknown(case, "host", spec.hosts, _hosts(spec))
    yield from _unknown(case, "robot", spec.robots, _robots(spec))
    yield from _unknown(case, "computer", case.computers, _computers(spec))
    commanders = {**spec.programs, **spec.robots, **spec.hosts}
    yield from _unknown(case, "program, robot or host", commanders, _commanders(spec))


def _unknown(
    case: Case, what: str, known: Mapping[str, Any], places: Iterable[Named]
) -> Iterator[Diagnostic]:
    words: tuple[str, ...] = ()  # made only where a name is unknown
    for word, loc in places:
        if word is not None and word not in known:
            words = words or tuple(known)
            yield Diagnostic(
                "REF001",
                f"there is no {what} called `{word}`",
                case.span(*loc),
                label="not defined",
                help=did_you_mean(word, words, f"known {what}s"),
                fix=_nearest(case, words, word, loc),
            )


def _nearest(case: Case, known: tuple[str, ...], word: str, loc: Loc) -> Fix | None:
    near = nearest(word, known)
    return mend(f"write `{near}`", replace_value(case.source, loc, near)) if near else None


def _types(spec: Spec) -> Iterator[Named]:
    return ((robot.type, ("robots", name, "type")) for name, robot in spec.robots.items())


def _hosts(spec: Spec) -> Iterator[Named]:
    yield from ((getattr(spec, key), (key,)) for key in ("leader", "hub"))
    yield spec.time.root, ("time", "root")
    yield from ((robot.host, ("robots", name, "host")) for name, robot in spec.robots.items())
    yield from ((host.via, ("hosts", name, "via")) for name, host in spec.hosts.items())
    yield from ((program.host, ("programs", name, "host")) for name, program in spec.programs.items())
    for index, link in enumerate(spec.links):
        if isinstance(link, NetworkLink):
            yield from ((host, ("links", index, "hosts", place)) for place, host in enumerate(link.hosts))
        else:
            yield link.host, ("links", index, "host")
    for name, island in spec.islands.items():
        yield from ((getattr(island, key), ("islands", name, key)) for key in ("leader", "hub"))
        yield from ((host, ("islands", name, "hosts", place)) for place, host in enumerate(island.hosts))


def _robots(spec: Spec) -> Iterator[Named]:
    for index, link in enumerate(spec.links):
        if isinstance(link, (Serial, Bluetooth)):
            yield link.robot, ("links", index, "robot")
    yield from ((program.robot, ("programs", name, "robot")) for name, program in spec.programs.items())
    for index, control in enumerate(spec.control):
        yield from ((robot, ("control", index, "of", place)) for place, robot in enumerate(control.of))


def _computers(spec: Spec) -> Iterator[Named]:
    yield from ((host.computer, ("hosts", name, "computer")) for name, host in spec.hosts.items())
    yield spec.defaults.host.computer, ("defaults", "host", "computer")


def _commanders(spec: Spec) -> Iterator[Named]:
    return ((control.by, ("control", index, "by")) for index, control in enumerate(spec.control))


def circular_jumps(case: Case) -> Iterator[Diagnostic]:
    """REF002: a chain of `via` that comes back to where it began."""
    hosts = case.spec.hosts
    settled: set[str] = set()
    for name in hosts:
        passed: dict[str, None] = {}  # in their order
        step: str | None = name
        while step is not None and step not in settled and step not in passed:
            passed[step] = None
            step = hosts[step].via
        settled.update(passed)
        circle = list(passed)[list(passed).index(step) :] if step in passed else []
        for place, one in enumerate(circle):
            rest = [*circle[place + 1 :], *circle[:place]]
            shown = rest if len(rest) < _SHOWN else [*rest[:_SHOWN], "..."]
            way = " via ".join([one, *shown, one])
            yield Diagnostic(
                "REF002",
                f"the way to host `{one}` goes in a circle: {way}",
                case.span("hosts", one, "via"),
                help=("one host on the way must be reachable without `via`",),
            )


def repeated_names(case: Case) -> Iterator[Diagnostic]:
    """REF003: a list that names one thing twice; most often the second was to be another."""
    spec = case.spec
    lists: list[tuple[tuple[str | int, ...], tuple[str, ...]]] = [
        (("links", index, "hosts"), link.hosts) for index, link in case.networks
    ]
    lists += [(("control", index, "of"), control.of) for index, control in enumerate(spec.control)]
    lists += [(("hosts", name, "bluetooth"), host.bluetooth) for name, host in spec.hosts.items()]
    for loc, listed in lists:
        if len(set(listed)) == len(listed):
            continue
        for place, name in enumerate(listed):
            if name in listed[:place]:
                yield Diagnostic(
                    "REF003",
                    f"`{name}` stands twice in one list",
                    case.span(*loc, place),
                    severity=Severity.WARNING,
                    label="again",
                    notes=(Note(case.span(*loc, listed.index(name)), "first here"),),
                    help=("name another one, or remove it",),
                    fix=mend(f"remove the second `{name}`", remove(case.source, (*loc, place))),
                )


NAMES: tuple[Rule, ...] = (unknown_names,)
RULES: tuple[Rule, ...] = (circular_jumps, repeated_names)
