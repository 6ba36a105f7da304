"""The keys and hosts that each mode requires or rejects; in mode combined, the islands."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.render.multimaster import joins_islands
from swarmctl.spec import model
from swarmctl.spec.model import Mode
from swarmctl.swarm.bridges import provider_name
from swarmctl.swarm.discovery import has_master
from swarmctl.swarm.modes import MULTIMASTER, ROLES, hub_of
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
            fix=None
            if context.spec.mode is Mode.COMBINED and not context.spec.islands  # the mode may be wrong
            else make_fix(help_, remove(context.source, (*loc, other)), safe=False)
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
    alone = None
    starts = {line.host for _, line in context.lines}
    if spec.mode is Mode.LEADER and not others and len(spec.robots) > 1 and starts == {spec.leader}:
        edits = replace_value(context.source, ("mode",), Mode.SINGLE_MINDED.value)
        alone = make_fix("write `mode: single-minded`", edits, safe=False)
    for name, robot in spec.robots.items():
        if robot.host is None and spec.mode is not Mode.SINGLE_MINDED:
            lines = [line.host for _, line in context.lines_of[name]]
            host = lines[0] if lines else next(iter(spec.hosts))
            edits = set_key(context.source, ("robots", name), "host", host)
            yield Diagnostic(
                "MODE004",
                f"robot `{name}` has no host",
                context.span("robots", name, "host", key=True),
                label="`host` missing",
                help=(f"add `host: {host}`",),
                fix=alone
                or make_fix(
                    f"add `host: {host}`", edits, safe=others and len(lines) == 1 and host in spec.hosts
                ),
            )


@rule("MODE005", "MODE006")
def hosts_without_ros(context: RuleContext) -> Iterator[Diagnostic]:
    """Programs and drivers on other hosts than the leader, where only the leader runs ROS."""
    leaders: dict[str, str] = {}
    meant: dict[str, Fix | None] = {}  # by host, what makes its leader right
    for loc, leader, hosts in _under_sole_leaders(context):
        leaders.update(dict.fromkeys(hosts, leader))
        meant.update(dict.fromkeys(hosts, wrong_word(context, loc, leader, hosts)))
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
                fix=meant[host]
                or (_moved(context, ("programs", name, "host"), leaders[host]) if program.host else None),
            )
    for name, robot in spec.robots.items():
        if robot.host is not None and leaders.get(robot.host, robot.host) != robot.host:
            leader = leaders[robot.host]
            starts_there = leader in {line.host for _, line in context.lines_of[name]}
            yield Diagnostic(
                "MODE006",
                f"robot `{name}` cannot be driven by `{robot.host}`: only the leader `{leader}` runs ROS",
                context.span("robots", name, "host"),
                label="runs no ROS in mode `single-minded`",
                help=(f"write `host: {leader}`, and start the robot's link there, or choose mode `leader`",),
                fix=meant[robot.host]
                or (_moved(context, ("robots", name, "host"), leader) if starts_there else None),
            )


def _moved(context: RuleContext, loc: Loc, host: str) -> Fix | None:
    return make_fix(f"write `host: {host}`", replace_value(context.source, loc, host), safe=False)


def _under_sole_leaders(context: RuleContext) -> Iterator[tuple[Loc, str, Collection[str]]]:
    """Yields where a leader that alone runs ROS is named, the leader, and the hosts it leads."""
    spec = context.spec
    if spec.mode is Mode.SINGLE_MINDED and spec.leader is not None:
        yield (), spec.leader, spec.hosts
    for name, island in spec.islands.items() if spec.mode is Mode.COMBINED else ():
        if Mode(island.mode) is Mode.SINGLE_MINDED and island.leader is not None:
            yield ("islands", name), island.leader, island.hosts


def wrong_word(context: RuleContext, loc: Loc, leader: str, hosts: Collection[str]) -> Fix | None:
    """Returns the fix of the mode or leader at ``loc``, where all that these hosts do contradicts it.

    Robots whose lines start at their own hosts need another mode; where one other host does all, it leads.
    """
    robots, programs = context.spec.robots, context.spec.programs.values()
    lines = {(name, line.host) for name, found in context.lines_of.items() for _, line in found}
    works = {host for _, host in lines}
    works |= {one.host or "" for one in robots.values()} | {one.host or "" for one in programs}
    others = works.intersection(hosts) - {leader}
    if len(others) == 1 and (leader not in works or leader not in hosts):
        (other,) = others
        edits = replace_value(context.source, (*loc, "leader"), other)
        return make_fix(f"write `leader: {other}`", edits, safe=False)
    if any((name, one.host) in lines and one.host in others for name, one in robots.items()):
        edits = replace_value(context.source, (*loc, "mode"), "leader")
        return make_fix("write `mode: leader`", edits, safe=False)
    return None


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
            fix=make_fix(
                "write `mode: combined`", replace_value(context.source, ("mode",), "combined"), safe=False
            )
            if spec.leader is None and spec.hub is None
            else None,
        )


@rule("MODE018")
def multimaster_of_one_graph(context: RuleContext) -> Iterator[Diagnostic]:
    """`multimaster` in a mode with one graph."""
    spec = context.spec
    if spec.multimaster is not None and spec.mode not in MULTIMASTER:
        yield Diagnostic(
            "MODE018",
            f"`multimaster` has no effect in mode `{spec.mode.value}`",
            context.span("multimaster", key=True),
            label="nothing of it is used",
            notes=(Note(context.span("mode"), "all hosts share one graph"),),
            help=("remove it, or choose mode `standalone` or `combined`",),
            fix=make_fix("remove `multimaster`", remove(context.source, ("multimaster",)), safe=False),
        )


@rule("MODE016")
def optional_hubs(context: RuleContext) -> Iterator[Diagnostic]:
    """An optional host that runs the master, or all discovery servers, of other hosts."""
    spec = context.spec
    for island in context.islands:
        master_mb = context.distros[island.distro].master_mb
        servers = (island.hub,) if master_mb else island.discovery.servers
        if len(island.hosts) < 2 or not servers or not all(_is_optional(spec, one) for one in servers):
            continue
        nested = spec.mode is Mode.COMBINED
        loc: Loc = ("islands", island.name) if nested else ()
        role = ROLES.get(Mode(spec.islands[island.name].mode) if nested else spec.mode)
        loc = (*loc, role.key) if role is not None and servers == (island.hub,) else ("ros", "servers")
        duty, only = ("master", "") if master_mb else ("discovery server", "only ")
        yield Diagnostic(
            "MODE016",
            f"host `{servers[0]}` is optional, but runs the {only}{duty} of {len(island.hosts)} hosts",
            context.span("hosts", servers[0], "optional"),
            label="required by all of them",
            notes=(Note(context.span(*loc), "its role"),),
            help=(f"remove `optional`, or run the {duty} on another host",),
            fix=make_fix(
                "remove `optional`", remove(context.source, ("hosts", servers[0], "optional")), safe=False
            ),
        )


def _is_optional(spec: model.Spec, host: str) -> bool:
    return host in spec.hosts and spec.hosts[host].optional


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
                fix=make_fix(
                    f"remove the second `{host}`",
                    remove(context.source, ("islands", name, "hosts", place)),
                    safe=False,
                )
                if same
                else None,
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
    named, distros = spec.multimaster and spec.multimaster.provider, tuple(context.distros)
    if named and joins_islands(None, distros) and not joins_islands(spec.multimaster, distros):
        loc, ours = ("multimaster", "provider"), provider_name(None, distros[0])
        yield Diagnostic(
            "MODE017",
            f"the provider `{named}` does not join islands of `{'` and `'.join(distros)}`",
            context.span(*loc),
            label="the islands share no topics",
            help=(f"write `{ours}`, or leave `provider` out",),
            fix=make_fix(f"write `{ours}`", replace_value(context.source, loc, ours), safe=False),
        )
        return
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
