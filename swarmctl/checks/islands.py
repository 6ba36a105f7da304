"""Mode combined: every host lives on one island, and every island has a master among its own hosts."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.edits import append_item, mend
from swarmctl.spec.model import Mode
from swarmctl.topology.bridges import commanders_host
from swarmctl.topology.interfaces import program_host
from swarmctl.topology.modes import ROLES, hub_of


def enough_islands(case: Case) -> Iterator[Diagnostic]:
    """MODE010, MODE014: mode combined is made of islands, two at least."""
    spec = case.spec
    if spec.mode is not Mode.COMBINED or len(spec.islands) > 1:
        return
    if not spec.islands:
        yield Diagnostic(
            "MODE010",
            "mode `combined` needs `islands`",
            case.span("mode"),
            label="which hosts share a master?",
            help=(
                "add them: islands: {west: {mode: central, hub: ..., hosts: [...]}, east: {...}}",
                "if each host runs a master of its own, write `mode: standalone`",
            ),
        )
        return
    [(name, island)] = spec.islands.items()
    yield Diagnostic(
        "MODE014",
        f"`{name}` is the only island, and there is nothing to combine",
        case.span("islands", name, key=True),
        severity=Severity.WARNING,
        label="one island",
        help=(f"write `mode: {island.mode}` for the whole swarm, or add the other islands",),
    )


def homes(case: Case) -> Iterator[Diagnostic]:
    """MODE011, MODE012: every host is on one island, and on one only."""
    spec = case.spec
    if spec.mode is not Mode.COMBINED or not spec.islands:
        return
    first: dict[str, tuple[str, int]] = {}
    for name, island in spec.islands.items():
        for place, host in enumerate(island.hosts):
            if host not in first:
                first[host] = (name, place)
                continue
            other, earlier = first[host]
            same = other == name
            yield Diagnostic(
                "MODE012",
                f"host `{host}` is listed twice on island `{name}`"
                if same
                else f"host `{host}` is on two islands, `{other}` and `{name}`",
                case.span("islands", name, "hosts", place),
                label="a second time" if same else "a host has one master",
                notes=(Note(case.span("islands", other, "hosts", earlier), "named here first"),),
                help=("keep one of the two; what the other island needs crosses by itself",),
            )
    ways = {host.via for host in spec.hosts.values()} - _working(case)  # to jump through is no work for ROS
    hubs = {hub_of(island) for island in spec.islands.values()}  # of those MODE013 tells
    for host in spec.hosts:
        if host not in first and host not in ways and host not in hubs:
            yield Diagnostic(
                "MODE011",
                f"host `{host}` is on no island",
                case.span("hosts", host, key=True),
                label="which master does it follow?",
                help=("add it to the `hosts` of an island",),
            )


def _working(case: Case) -> set[str]:
    """The hosts that drive a robot, run a program or command."""
    spec = case.spec
    found = {*case.driving.values(), *(program_host(spec, one) for one in spec.programs.values())}
    found |= {commanders_host(spec, one.by) for one in spec.control}
    return {host for host in found if host is not None}


def hubs_at_home(case: Case) -> Iterator[Diagnostic]:
    """MODE013: the host that runs an island's master is one of its hosts."""
    spec = case.spec
    if spec.mode is not Mode.COMBINED:
        return
    for name, island in spec.islands.items():
        hub = hub_of(island)
        if hub is not None and hub not in island.hosts:
            key = ROLES[Mode(island.mode)].key
            yield Diagnostic(
                "MODE013",
                f"`{hub}` is to run the master of island `{name}`, and is not on it",
                case.span("islands", name, key),
                label=f"not among the hosts of `{name}`",
                notes=(Note(case.span("islands", name, "hosts"), "its hosts"),),
                help=(f"add `{hub}` to the hosts of `{name}`, or name one of them",),
                fix=None
                if any(hub in other.hosts for other in spec.islands.values())
                else mend(
                    f"add `{hub}` to the hosts of `{name}`",
                    append_item(case.source, ("islands", name, "hosts"), hub),
                ),
            )


def empty_islands(case: Case) -> Iterator[Diagnostic]:
    """MODE015: an island on which no robot drives, no program runs and nobody commands."""
    spec = case.spec
    if spec.mode is not Mode.COMBINED or len(case.islands) < 2:
        return
    working = _working(case)
    for island in case.islands:
        if working.isdisjoint(island.hosts):
            yield Diagnostic(
                "MODE015",
                f"island `{island.name}` has no robot, no program and no one who commands",
                case.span("islands", island.name, key=True),
                severity=Severity.WARNING,
                label="a master for nobody",
                help=("remove it with its hosts, or let its hosts do something",),
            )


def misleading_names(case: Case) -> Iterator[Diagnostic]:
    """MODE017: an island has the name of a host that lives on another one."""
    spec = case.spec
    if spec.mode is not Mode.COMBINED:
        return
    for name, island in spec.islands.items():
        if name in spec.hosts and name not in island.hosts:
            yield Diagnostic(
                "MODE017",
                f"island `{name}` has the name of a host that is not on it",
                case.span("islands", name, key=True),
                severity=Severity.WARNING,
                label="island or host?",
                notes=(Note(case.span("hosts", name, key=True), "the host"),),
                help=("rename the island",),
            )


RULES: tuple[Rule, ...] = (
    enough_islands,
    homes,
    hubs_at_home,
    empty_islands,
    misleading_names,
)
