"""All hosts that run ROS can follow one clock, and that clock is right after a power cut."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec import edits
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.topology.address import means_self, normal
from swarmctl.topology.clocks import time_root


def followers(case: Case) -> Iterator[Diagnostic]:
    """TIME001: every host that runs ROS shares a network with the time root. Of a hub NET001 tells."""
    root = case.spec.time.root
    if root is None or root not in case.home:
        return
    beside = {host for index, _ in case.networks_of[root] for host in case.members[index]} | {root}
    for name in case.home:
        if name not in beside:
            yield Diagnostic(
                "TIME001",
                f"host `{name}` cannot follow the clock of `{root}`",
                case.span("hosts", name, key=True),
                label="no wlan or ethernet joins the two",
                notes=(Note(case.span("time", "root"), "the time root"),),
                help=(f"put `{name}` and `{root}` on one network, or choose another root",),
            )


def roots_without_clock(case: Case) -> Iterator[Diagnostic]:
    """TIME002: after a power cut the root itself does not know the time, and asks nobody."""
    root = time_root(case.spec, case.islands)
    if root is None or len(case.home) < 2 or case.spec.time.servers or _keeps_time(case, root) is not False:
        return
    place = ("time", "root") if case.spec.time.root is not None else ("hosts", root)
    named = next((name for name in case.home if _keeps_time(case, name)), None)
    yield Diagnostic(
        "TIME002",
        f"`{root}`, whose clock the others follow, has no battery for it and asks no server",
        case.span(*place, key=case.spec.time.root is None),
        severity=Severity.WARNING,
        label=f"a {case.computer_of(root)} starts with a wrong time",
        help=(
            *((f"let the swarm follow a host with a clock: time: {{root: {named}}}",) if named else ()),
            "name a server that it reaches: time: {servers: [pool.ntp.org]}",
        ),
    )


def missing_roots(case: Case) -> Iterator[Diagnostic]:
    """TIME003: several masters, hosts without a clock, and nobody whom all follow."""
    if len(case.islands) < 2 or case.spec.time.root is not None:
        return
    lost = next((name for name in case.home if _keeps_time(case, name) is False), None)
    if lost is None:
        return
    hubs = [island.hub for island in case.islands]
    named = next((hub for hub in hubs if _keeps_time(case, hub)), hubs[0])
    yield Diagnostic(
        "TIME003",
        f"host `{lost}` keeps no time without power, and {len(hubs)} masters have no clock in common",
        case.span("hosts", lost, key=True),
        severity=Severity.WARNING,
        label=f"a {case.computer_of(lost)} starts with a wrong time",
        help=(f"add `time: {{root: {named}}}`: all hosts then follow its clock",),
        fix=edits.mend(f"let all hosts follow `{named}`", _with_root(case, named)),
    )


def unfit_roots(case: Case) -> Iterator[Diagnostic]:
    """TIME004, TIME005: a root that is not configured, or that may be absent."""
    root = case.spec.time.root
    if root is None:
        return
    if root not in case.home:
        yield Diagnostic(
            "TIME004",
            f"`{root}` runs no ROS and gets no configuration; nobody can follow its clock",
            case.span("time", "root"),
            label="the time root",
            notes=(Note(case.span("hosts", root, key=True), "nothing of the swarm runs here"),),
            help=(f"hosts that run ROS: {', '.join(f'`{name}`' for name in list(case.home)[:5])}",),
        )
    elif case.spec.hosts[root].optional:
        yield Diagnostic(
            "TIME005",
            f"the time root `{root}` may be absent; the others then drift apart",
            case.span("time", "root"),
            severity=Severity.WARNING,
            label="the time root",
            notes=(Note(case.span("hosts", root, "optional"), "optional"),),
            help=("choose a host that is always there",),
        )


def circles(case: Case) -> Iterator[Diagnostic]:
    """TIME006: the root follows a host that follows the root."""
    if not case.spec.time.servers:
        return
    root = time_root(case.spec, case.islands)
    hosts = {normal(host.address): name for name, host in case.spec.hosts.items()}
    for place, server in enumerate(case.spec.time.servers):
        name = root if means_self(server) else hosts.get(normal(server))
        if name is None:
            continue
        who = f"the time root `{name}` itself" if name == root else f"host `{name}`, which follows the root"
        yield Diagnostic(
            "TIME006",
            f"the time root cannot follow `{server}`: that is {who}",
            case.span("time", "servers", place),
            label="a circle",
            help=("name a server outside the swarm",),
        )


def _with_root(case: Case, host: str) -> edits.Edits:
    source = case.document.source
    if "time" in case.spec.model_fields_set:
        return edits.set_key(source, ("time",), "root", host)
    return edits.set_key(source, (), "time", {"root": host})


def _keeps_time(case: Case, host: str) -> bool | None:
    """Whether a host's clock runs without power; unknown for a computer that is not named."""
    computer = case.computer_of(host)
    return case.computers[computer].clock if computer is not None else None


RULES: tuple[Rule, ...] = (followers, roots_without_clock, missing_roots, unfit_roots, circles)
