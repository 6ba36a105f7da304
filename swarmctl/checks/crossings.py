"""What `multimaster.topics` lets cross between islands exists, arrives somewhere, and is one topic."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Severity
from swarmctl.spec.edits import mend, replace_value
from swarmctl.spec.multimaster import Crossing
from swarmctl.spec.source import Loc
from swarmctl.spec.suggest import did_you_mean, nearest
from swarmctl.topology.interfaces import COMMON, DIAGNOSTICS, sensors_of
from swarmctl.topology.modes import MULTIMASTER
from swarmctl.topology.names import parted


def _crossings(case: Case) -> Iterator[tuple[Loc, Crossing]]:
    settings = case.spec.multimaster
    if settings is not None and case.spec.mode in MULTIMASTER:
        for index, crossing in enumerate(settings.topics):
            yield ("multimaster", "topics", index), crossing


def destinations(case: Case) -> Iterator[Diagnostic]:
    """MM010, MM013: a topic crosses to an island that there is, and to another than its own."""
    islands = {island.name: None for island in case.islands}
    for loc, crossing in _crossings(case):
        for place, to in enumerate(crossing.to):
            if to in islands:
                continue
            home = case.home.get(to)
            meant = home.name if home is not None else nearest(to, tuple(islands))
            where = (*loc, "to", place)
            yield Diagnostic(
                "MM010",
                f"there is no island called `{to}`",
                case.span(*where),
                label="a host, not an island" if to in case.spec.hosts else "not defined",
                help=(f"host `{to}` is on island `{home.name}`",)
                if home is not None
                else did_you_mean(to, islands, "the islands are"),
                fix=mend(f"write `{meant}`", replace_value(case.source, where, meant)) if meant else None,
            )
        origins = case.publishers.of(crossing.topic)
        if len(origins) == 1 and set(crossing.to) == set(origins):
            yield Diagnostic(
                "MM013",
                f"`{crossing.topic}` comes from `{crossing.to[0]}` and crosses to nowhere else",
                case.span(*loc, "to"),
                severity=Severity.WARNING,
                label="at home there already",
                help=("name the islands that are to hear it",),
            )


def origins(case: Case) -> Iterator[Diagnostic]:
    """MM011, MM012: a topic that crosses is published somewhere, and is not everybody's at once."""
    for loc, crossing in _crossings(case):
        where, topic = (*loc, "topic"), crossing.topic
        if topic in COMMON and topic != DIAGNOSTICS:
            yield Diagnostic(
                "MM012",
                f"`{topic}` would bring everything that one island says there to the others",
                case.span(*where),
                severity=Severity.WARNING,
                label="each island has its own",
                help=("let single topics cross; `odom` says where a robot is",),
            )
        elif topic.startswith("/") and not case.publishers.of(topic):
            near = _nearest(case, topic)
            yield Diagnostic(
                "MM011",
                f"`{topic}` is to cross, but nobody is said to publish it",
                case.span(*where),
                label="from which island?",
                help=(f"did you mean `{near}`?",)
                if near
                else ("correct the name, or declare it under `publishes` of the program that it comes from",),
                fix=mend(f"write `{near}`", replace_value(case.source, where, near)) if near else None,
            )


def _nearest(case: Case, topic: str) -> str | None:
    space = parted(topic)[0]
    known = [*case.publishers.programs]
    if (robot := case.publishers.robots.get(space)) is not None:
        said = case.spec.robots[robot]
        known += [f"{space}/{one}" for one in sensors_of(case.types[said.type], said.driver)]
    return nearest(topic, tuple(known))


RULES: tuple[Rule, ...] = (destinations, origins)
