"""The keys and hosts that each mode requires or rejects; in mode combined, the islands."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.render.multimaster import joins_islands
from swarmctl.spec import model
from swarmctl.spec.model import Mode
from swarmctl.swarm.discovery import has_master
from swarmctl.swarm.modes import ROLES, hub_of
from swarmctl.yamltext.edits import append_item, make_fix, remove, rename_key, replace_value, set_key

Loc = tuple[str | int, ...]

_STANDALONE = ("if each host runs its own master, write `mode: standalone`",)


@rule("MODE002", "MODE003", names=True)
def roles(context: RuleContext) -> Iterator[Diagnostic]:
    """A mode without its leader or hub, or with the key of another mode."""
    spec = context.spec
    yield from _role(context, (), spec, f"mode `{spec.mode.value}`", tuple(spec.hosts))
    if spec.mode is Mode.COMBINED:
        for name, island in spec.islands.items():
            title = f"island `{name}` in mode `{island.mode}`"
            yield from _role(context, ("islands", name), island, title, island.hosts)


def _role(
    context: RuleContext, loc: Loc, within: model.Spec | model.Island, title: str, hosts: tuple[str, ...]
) -> Iterator[Diagnostic]:
    role = ROLES.get(Mode(within.mode))
    distro = getattr(within, "distro", None) or context.spec.ros.distro
    duty = role and (role.duty if has_master(distro) else role.without_master)
    named = [key for key in ("leader", "hub") if getattr(within, key) is not None]
    if role is not None and not named:
        added = f"add `{role.key}: {hosts[0]}`"
        yield Diagnostic(
            "MODE002",
            f"{title} needs a `{role.key}`",
            context.span(*loc, role.key, "mode"),
            label=f"`{role.key}` is the host that {duty}",
            help=(added,),
            fix=make_fix(
                added, set_key(context.source, loc, role.key, hosts[0], after="mode"), safe=len(hosts) == 1
            ),
        )
    for other in named:
        if role is None:
            label, help_ = "this mode has neither leader nor hub", "remove this line"
        elif other == role.key:
            continue
        else:
            label = f"the host that {duty} is called `{role.key}`"
            both = role.key in named
            help_ = "remove this line" if both else f"write `{role.key}: {getattr(within, other)}`"
        yield Diagnostic(
            "MODE003",
            f"{title} has no `{other}`",
            context.span(*loc, other, key=True),
            label=label,
            notes=(Note(context.span(*loc, role.key, key=True), "already set here"),)
            if role and role.key in named
            else (),
            help=(help_,),
            fix=make_fix(help_, remove(context.source, (*loc, other)), safe=False)
            if role is None or role.key in named
            else make_fix(
                f"rename the key to `{role.key}`",
                rename_key(context.source, (*loc, other), role.key),
                safe=False,
            ),
        )


@rule("MODE004", names=True)
def robots_have_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot without `host`, in a mode other than single-minded."""
    spec = context.spec
    others = any(robot.host is not None for robot in spec.robots.values())  # else the mode may be wrong
    for name, robot in spec.robots.items():
        if robot.host is None and spec.mode is not Mode.SINGLE_MINDED:
            lines = [line.host for _, line in context.lines_of[name]]
            host = lines[0] if lines else next(iter(spec.hosts))
            yield Diagnostic(
                "MODE004",
                f"robot `{name}` has no host",
                context.span("robots", name, "host", key=True),
                label="`host` missing",
                help=(f"add `host: {host}`",),
                fix=make_fix(
                    f"add `host: {host}`",
                    set_key(context.source, ("robots", name), "host", host),
                    safe=others and len(lines) == 1 and host in spec.hosts,
                ),
            )


@rule("MODE005", "MODE006")
def hosts_without_ros(context: RuleContext) -> Iterator[Diagnostic]:
    """Programs and drivers on other hosts than the leader, where only the leader runs ROS."""
    leaders = _sole_leaders(context)
    if not leaders:
        return
    spec = context.spec
    for name, program in spec.programs.items():
        host = context.program_hosts[name]
        if host in leaders and leaders[host] != host:
            yield Diagnostic(
                "MODE005",
                f"program `{name}` cannot run on `{host}`: only the leader `{leaders[host]}` runs ROS",
                context.span("programs", name, "host" if program.host else "robot"),
                label="runs no ROS in mode `single-minded`",
                help=(f"run it on `{leaders[host]}`, or choose mode `leader`",),
                fix=_moved(context, ("programs", name, "host"), leaders[host]) if program.host else None,
            )
    for name, robot in spec.robots.items():
        if robot.host is not None and leaders.get(robot.host, robot.host) != robot.host:
            leader = leaders[robot.host]
            yield Diagnostic(
                "MODE006",
                f"robot `{name}` cannot be driven by `{robot.host}`: only the leader `{leader}` runs ROS",
                context.span("robots", name, "host"),
                label="runs no ROS in mode `single-minded`",
                help=(f"write `host: {leader}`, and start the robot's link there",),
                fix=_moved(context, ("robots", name, "host"), leader),
            )


def _moved(context: RuleContext, loc: Loc, host: str) -> Fix | None:
    return make_fix(f"write `host: {host}`", replace_value(context.source, loc, host), safe=False)


def _sole_leaders(context: RuleContext) -> dict[str, str]:
    """Returns by host the leader that alone runs ROS: the swarm's, or the one of its island."""
    spec = context.spec
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


@rule("MODE007")
def unused_islands(context: RuleContext) -> Iterator[Diagnostic]:
    """`islands` in a mode that does not use them."""
    spec = context.spec
    if spec.islands and spec.mode is not Mode.COMBINED:
        yield Diagnostic(
            "MODE007",
            f"mode `{spec.mode.value}` has no `islands`",
            context.span("islands", key=True),
            label="has no effect",
            notes=(Note(context.span("mode"), "the mode"),),
            help=("remove them, or write `mode: combined`",),
            fix=make_fix("remove `islands`", remove(context.source, ("islands",)), safe=False),
        )


@rule("MODE016")
def optional_hubs(context: RuleContext) -> Iterator[Diagnostic]:
    """An optional host that runs the master of other hosts."""
    spec = context.spec
    for island in context.islands:
        hub, master_mb = spec.hosts.get(island.hub), context.distros[island.distro].master_mb
        if not master_mb or len(island.hosts) < 2 or hub is None or not hub.optional:
            continue
        nested = spec.mode is Mode.COMBINED
        loc: Loc = ("islands", island.name) if nested else ()
        key = ROLES[Mode(spec.islands[island.name].mode) if nested else spec.mode].key
        yield Diagnostic(
            "MODE016",
            f"host `{island.hub}` is optional, but runs the master of {len(island.hosts)} hosts",
            context.span("hosts", island.hub, "optional"),
            label="required by all of them",
            notes=(Note(context.span(*loc, key), "its role"),),
            help=("remove `optional`, or run the master on another host",),
            fix=make_fix(
                "remove `optional`", remove(context.source, ("hosts", island.hub, "optional")), safe=False
            ),
        )


@rule("MODE010")
def missing_islands(context: RuleContext) -> Iterator[Diagnostic]:
    """Mode combined without islands."""
    spec = context.spec
    if spec.mode is Mode.COMBINED and not spec.islands:
        yield Diagnostic(
            "MODE010",
            "mode `combined` needs `islands`",
            context.span("mode"),
            label="no islands",
            help=(
                "add them: islands: {west: {mode: central, hub: ..., hosts: [...]}, east: {...}}",
                *_STANDALONE[: context.has_masters],
            ),
        )


@rule("MODE011", "MODE012")
def island_membership(context: RuleContext) -> Iterator[Diagnostic]:
    """A host on no island, or on several."""
    spec = context.spec
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
                context.span("islands", name, "hosts", place),
                label="second entry"
                if same
                else f"a host {'follows one master' if context.has_masters else 'is on one island'}",
                notes=(Note(context.span("islands", other, "hosts", earlier), "first entry"),),
                help=("keep one of the two; topics that the other island needs are bridged",),
            )
    ways = {host.via for host in spec.hosts.values()} - _working(
        context
    )  # to jump through is no work for ROS
    hubs = {hub_of(island) for island in spec.islands.values()}  # MODE013 reports these
    for host in spec.hosts:
        if host not in first and host not in ways and host not in hubs:
            yield Diagnostic(
                "MODE011",
                f"host `{host}` is on no island",
                context.span("hosts", host, key=True),
                label="follows no master" if context.has_masters else "in no graph",
                help=("add it to the `hosts` of an island",),
            )


@rule("MODE017")
def unjoined_islands(context: RuleContext) -> Iterator[Diagnostic]:
    """Several islands, and nothing that carries topics from one to another."""
    spec, islands = context.spec, context.islands
    if len(islands) < 2 or context.joins_islands:
        return
    methods = {one.discovery.method for one in context.unreached}
    if not joins_islands(spec.multimaster, tuple(context.distros)):
        why = f"swarmctl does not bridge islands of `{'` and `'.join(context.distros)}`"
    elif methods:
        why = f"a relay finds no nodes by discovery `{min(methods)}`"
    else:
        why = "a relay has no key of `sros2`"
    yield Diagnostic(
        "MODE017",
        f"the {len(islands)} islands of mode `{spec.mode.value}` share no topics: {why}",
        context.span("mode"),
        label="several islands",
        notes=(Note(context.span("ros"), "as `ros` has it"),),
        help=(
            "write `discovery: peers`, without `servers`",
            "or `mode: central` with a `hub`, or `mode: leader`: one island with all hosts",
        ),
    )


def _working(context: RuleContext) -> set[str]:
    """Returns the hosts that drive a robot, run a program or command."""
    spec = context.spec
    found = {*context.driving.values(), *context.program_hosts.values()}
    found |= {context.commander_host(one.by) for one in spec.control}
    return {host for host in found if host is not None}


@rule("MODE013")
def hubs_on_their_islands(context: RuleContext) -> Iterator[Diagnostic]:
    """An island whose master would run on a host of another island."""
    spec = context.spec
    if spec.mode is not Mode.COMBINED:
        return
    for name, island in spec.islands.items():
        hub = hub_of(island)
        if hub is not None and hub not in island.hosts:
            key = ROLES[Mode(island.mode)].key
            yield Diagnostic(
                "MODE013",
                f"the {key} `{hub}` of island `{name}` is not one of its hosts",
                context.span("islands", name, key),
                label="not in its `hosts`",
                notes=(Note(context.span("islands", name, "hosts"), "its hosts"),),
                help=(f"add `{hub}` to the hosts of `{name}`, or choose one of them",),
                fix=None
                if any(hub in other.hosts for other in spec.islands.values())
                else make_fix(
                    f"add `{hub}` to the hosts of `{name}`",
                    append_item(context.source, ("islands", name, "hosts"), hub),
                    safe=False,
                ),
            )
