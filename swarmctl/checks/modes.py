"""What each working mode asks of a spec: who leads, where ROS runs, which keys mean something."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec import model
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note, Severity
from swarmctl.spec.edits import mend, remove, rename_key, replace_value, set_key
from swarmctl.spec.model import Mode
from swarmctl.topology.interfaces import program_host
from swarmctl.topology.modes import MULTIMASTER, ROLES

Loc = tuple[str | int, ...]


def roles(case: Case) -> Iterator[Diagnostic]:
    """MODE002, MODE003: the host that a mode is built around is named, and no other role is."""
    spec = case.spec
    yield from _role(case, (), spec, f"mode `{spec.mode.value}`", tuple(spec.hosts))
    if spec.mode is Mode.COMBINED:
        for name, island in spec.islands.items():
            title = f"island `{name}` in mode `{island.mode}`"
            yield from _role(case, ("islands", name), island, title, island.hosts)


def _role(
    case: Case, loc: Loc, within: model.Spec | model.Island, title: str, hosts: tuple[str, ...]
) -> Iterator[Diagnostic]:
    role = ROLES.get(Mode(within.mode))
    named = [key for key in ("leader", "hub") if getattr(within, key) is not None]
    if role is not None and not named:
        added = f"add `{role.key}: {hosts[0]}`"
        yield Diagnostic(
            "MODE002",
            f"{title} needs a `{role.key}`",
            case.span(*loc, "mode"),
            label=f"which host {role.duty}?",
            help=(added,),
            fix=mend(added, set_key(case.source, loc, role.key, hosts[0], after="mode")),
        )
    for other in named:
        if role is None:
            label, help_ = "each master has a host of its own", "remove this line"
        elif other == role.key:
            continue
        else:
            label = f"the host that {role.duty} is called `{role.key}`"
            both = role.key in named
            help_ = "remove this line" if both else f"write `{role.key}: {getattr(within, other)}`"
        yield Diagnostic(
            "MODE003",
            f"{title} has no `{other}`",
            case.span(*loc, other, key=True),
            label=label,
            notes=(Note(case.span(*loc, role.key, key=True), "named here"),)
            if role and role.key in named
            else (),
            help=(help_,),
            fix=mend(help_, remove(case.source, (*loc, other)))
            if role is None or role.key in named
            else mend(f"rename the key to `{role.key}`", rename_key(case.source, (*loc, other), role.key)),
        )


def robots_have_hosts(case: Case) -> Iterator[Diagnostic]:
    """MODE004: outside single-minded, every robot says which host drives it."""
    spec = case.spec
    for name, robot in spec.robots.items():
        if robot.host is None and spec.mode is not Mode.SINGLE_MINDED:
            host = next((line.host for _, line in case.lines_of[name]), next(iter(spec.hosts)))
            yield Diagnostic(
                "MODE004",
                f"robot `{name}` has no host",
                case.span("robots", name, key=True),
                label="which host drives it?",
                help=(f"add `host: {host}`",),
                fix=mend(f"add `host: {host}`", set_key(case.source, ("robots", name), "host", host)),
            )


def work_without_ros(case: Case) -> Iterator[Diagnostic]:
    """MODE005, MODE006: where only the leader runs ROS, no program and no driver is placed elsewhere."""
    leaders = _sole_leaders(case)
    if not leaders:
        return
    spec = case.spec
    for name, program in spec.programs.items():
        host = program_host(spec, program)
        if host in leaders and leaders[host] != host:
            yield Diagnostic(
                "MODE005",
                f"program `{name}` is to run on `{host}`, but only the leader `{leaders[host]}` runs ROS",
                case.span("programs", name, "host" if program.host else "robot"),
                label="no ROS here in mode `single-minded`",
                help=(f"let it run on `{leaders[host]}`, or choose mode `leader`",),
                fix=_moved(case, ("programs", name, "host"), leaders[host]) if program.host else None,
            )
    for name, robot in spec.robots.items():
        if robot.host is not None and leaders.get(robot.host, robot.host) != robot.host:
            leader = leaders[robot.host]
            yield Diagnostic(
                "MODE006",
                f"robot `{name}` cannot be driven by `{robot.host}`: only the leader `{leader}` runs ROS",
                case.span("robots", name, "host"),
                label="no driver runs here in mode `single-minded`",
                help=(f"write `host: {leader}`, and let the robot's line start there",),
                fix=_moved(case, ("robots", name, "host"), leader),
            )


def _moved(case: Case, loc: Loc, host: str) -> Fix | None:
    return mend(f"write `host: {host}`", replace_value(case.source, loc, host))


def _sole_leaders(case: Case) -> dict[str, str]:
    """By host, the leader that alone runs ROS there: the swarm's, or its island's."""
    spec = case.spec
    if spec.mode is Mode.SINGLE_MINDED and spec.leader is not None:
        return dict.fromkeys(spec.hosts, spec.leader)
    if spec.mode is not Mode.COMBINED:
        return {}
    return {
        host: island.leader
        for island in spec.islands.values()
        if Mode(island.mode) is Mode.SINGLE_MINDED and island.leader is not None
        for host in island.hosts
    }


def keys_of_other_modes(case: Case) -> Iterator[Diagnostic]:
    """MODE007, MODE008: `islands` and `multimaster` are there only where there are several masters."""
    spec = case.spec
    if spec.islands and spec.mode is not Mode.COMBINED:
        yield Diagnostic(
            "MODE007",
            f"mode `{spec.mode.value}` has no `islands`",
            case.span("islands", key=True),
            label="would be ignored",
            notes=(Note(case.span("mode"), "the mode"),),
            help=("remove them, or write `mode: combined`",),
            fix=mend("remove `islands`", remove(case.source, ("islands",))),
        )
    if spec.multimaster is not None and spec.mode not in MULTIMASTER:
        yield Diagnostic(
            "MODE008",
            f"mode `{spec.mode.value}` has one master, and nothing to join",
            case.span("multimaster", key=True),
            severity=Severity.WARNING,
            label="has no effect",
            notes=(Note(case.span("mode"), "the mode"),),
            help=("remove it, or choose mode `standalone` or `combined`",),
            fix=mend("remove `multimaster`", remove(case.source, ("multimaster",))),
        )


def lone_host(case: Case) -> Iterator[Diagnostic]:
    """MODE009: one host is no swarm of standalone robots."""
    spec = case.spec
    if spec.mode is Mode.STANDALONE and len(spec.hosts) == 1:
        [host] = spec.hosts
        yield Diagnostic(
            "MODE009",
            f"mode `standalone` joins the masters of several hosts, and `{host}` is the only one",
            case.span("mode"),
            severity=Severity.WARNING,
            label="one host, one master",
            help=(f"write `mode: single-minded` and `leader: {host}`, or add the other hosts",),
        )


def optional_hubs(case: Case) -> Iterator[Diagnostic]:
    """MODE016: a swarm is not complete without the host that runs its master."""
    spec = case.spec
    for island in case.islands:
        hub = spec.hosts.get(island.hub)
        if len(island.hosts) < 2 or hub is None or not hub.optional:
            continue
        nested = spec.mode is Mode.COMBINED
        loc: Loc = ("islands", island.name) if nested else ()
        key = ROLES[Mode(spec.islands[island.name].mode) if nested else spec.mode].key
        yield Diagnostic(
            "MODE016",
            f"host `{island.hub}` is optional, but runs the master of {len(island.hosts)} hosts",
            case.span("hosts", island.hub, "optional"),
            label="nothing works without it",
            notes=(Note(case.span(*loc, key), "its role"),),
            help=("remove `optional`, or let another host run the master",),
            fix=mend("remove `optional`", remove(case.source, ("hosts", island.hub, "optional"))),
        )


NAMES: tuple[Rule, ...] = (roles, robots_have_hosts)
RULES: tuple[Rule, ...] = (
    work_without_ros,
    keys_of_other_modes,
    lone_host,
    optional_hubs,
)
