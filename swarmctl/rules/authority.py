"""Command authority: one commander per robot at a time, and only the leader in mode `leader`."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.render.middleware import middleware_of
from swarmctl.spec.model import Mode
from swarmctl.swarm.addresses import advertised
from swarmctl.swarm.command_topics import SENDABLE
from swarmctl.swarm.resolved import appears_on
from swarmctl.swarm.topics import Endpoint
from swarmctl.yamltext.edits import append_item, make_fix, remove, set_key


@rule("AUTH001")
def other_commanders_than_leader(context: RuleContext) -> Iterator[Diagnostic]:
    """A commander on a leader's island that is not the leader."""
    spec = context.spec
    leaders = _leaders(context)
    for index, control in enumerate(spec.control if leaders else ()):
        host = context.commander_host(control.by) or ""
        home = context.home.get(host)
        if home is None or leaders.get(home.name, host) == host:
            continue
        leader = leaders[home.name]
        of = next((one for one in control.of if _island_of(context, one) == home.name), None)
        if of is None:
            continue
        where = f" on `{host}`" if host != control.by else ""
        loc = ("leader",) if spec.mode is Mode.LEADER else ("islands", home.name, "leader")
        yield Diagnostic(
            "AUTH001",
            f"`{control.by}`{where} commands `{of}`, but in mode `leader` only `{leader}` commands",
            context.span("control", index, "by"),
            label="not on the leader",
            notes=(Note(context.span(*loc), "the leader"),),
            help=(
                f"to allow other commanders, write `mode: central` and `hub: {leader}`",
                f"otherwise run the commanding program on `{leader}`",
            ),
        )


def _leaders(context: RuleContext) -> dict[str, str]:
    """Returns the leader of every island in mode leader, by the island's name."""
    spec = context.spec
    if spec.mode is Mode.LEADER:
        return {island.name: island.hub for island in context.islands}
    if spec.mode is not Mode.COMBINED:
        return {}
    return {one.name: one.hub for one in context.islands if spec.islands[one.name].mode == Mode.LEADER.value}


def _island_of(context: RuleContext, robot: str) -> str | None:
    home = context.home.get(context.driving[robot] or "")
    return home.name if home is not None else None


@rule("AUTH002", "AUTH003", "AUTH009")
def equal_priorities(context: RuleContext) -> Iterator[Diagnostic]:
    """Two commanders of one robot with the same priority; a robot listed twice for one commander."""
    first: dict[str, list[tuple[str, int, int, int]]] = {}
    for index, control in enumerate(context.spec.control):
        for place, robot in enumerate(control.of):
            earlier = first.setdefault(robot, [])
            for by, priority, other, there in earlier:
                if other == index or (by != control.by and priority != control.priority):
                    continue
                rival, equal = by != control.by, priority == control.priority
                twice = f"robot `{robot}` is listed twice for commander `{control.by}`"
                yield Diagnostic(
                    "AUTH002" if rival else "AUTH003" if equal else "AUTH009",
                    f"`{by}` and `{control.by}` command robot `{robot}` with the same priority, {priority}"
                    if rival
                    else twice
                    if equal
                    else f"{twice}, with the priorities {priority} and {control.priority}",
                    context.span("control", index, "of", place),
                    label="ambiguous authority" if rival else "second entry",
                    notes=(Note(context.span("control", other, "of", there), "first entry"),),
                    help=(f"give the commander that has to win a higher priority: priority: {priority + 1}",)
                    if rival
                    else ("keep one of the two",),
                    fix=None if rival else _once(context, index, place, equal=equal),
                )
                break
            earlier.append((control.by, control.priority, index, place))


def _once(context: RuleContext, index: int, place: int, *, equal: bool) -> Fix | None:
    """Returns the fix that removes an entry; a guess if another robot may have been meant."""
    commanded = {robot for control in context.spec.control for robot in control.of}
    alone = len(context.spec.control[index].of) == 1
    loc = ("control", index) if alone else ("control", index, "of", place)
    return make_fix(
        "remove the second entry",
        remove(context.source, loc),
        safe=equal and commanded >= set(context.spec.robots),
    )


@rule("AUTH004")
def unauthorised_programs(context: RuleContext) -> Iterator[Diagnostic]:
    """A program publishes commands or settings without authority from `control` or from the mode."""
    for one in context.endpoints:
        robots = context.robots_by_command.get(one.topic, ()) if one.publishes else ()
        moved = _robot_with_actuator(context, one.topic) if one.publishes and not robots else ()
        for robot in robots or moved:
            island = context.island_of_robot(robot)
            there = appears_on(one.host, context.home, island)
            known = there in context.spec.hosts and _names_hosts(context, context.driving[robot])
            address = advertised(context.spec, there) if known else ""
            over = context.authority.over(robot)
            if not any(commander.includes(one.node, address) for commander in over):
                yield _unauthorised(context, one, robot, sets=bool(moved))


def _robot_with_actuator(context: RuleContext, topic: str) -> tuple[str, ...]:
    space, name = context.split_topic(topic)
    robot = context.robot_by_namespace.get(space, "")
    kind = context.driven_robots.get(robot)
    return (robot,) if kind is not None and name in kind.actuators else ()


def _unauthorised(context: RuleContext, one: Endpoint, robot: str, *, sets: bool) -> Diagnostic:
    spec = context.spec
    what, label = "commands", f"the command topic of `{robot}`"
    if sets:
        what, label = "settings", f"sets an actuator of `{robot}`"
    listed = sorted(control.by for control in spec.control if robot in control.of)
    entry = {"by": one.owner, "of": [robot]}
    made = (
        append_item(context.source, ("control",), entry)
        if spec.control
        else set_key(context.source, (), "control", [entry])
    )
    listing = f"{{by: {one.owner}, of: [{robot}]"
    return Diagnostic(
        "AUTH004",
        f"program `{one.owner}` publishes {what} to robot `{robot}` without authority",
        context.span(*one.loc, "topic"),
        label=label,
        notes=(Note(context.span("control", key=True), "the list of commanders"),) if spec.control else (),
        help=(
            f"add to `control`: {listing}, priority: ...}}; "
            f"already commanding `{robot}`: `{'`, `'.join(listed)}`"
            if listed
            else f"add to `control`: {listing}}}",
        ),
        fix=None if listed else make_fix(f"add `{one.owner}` to `control` of `{robot}`", made, safe=False),
    )


@rule("AUTH005")
def commanders_without_commands(context: RuleContext) -> Iterator[Diagnostic]:
    """A commander declares what it publishes, and the robot's command topic is not among it."""
    spec = context.spec
    declared: dict[str, set[str]] = {}
    for one in context.endpoints:
        if one.publishes:
            declared.setdefault(one.owner, set()).add(one.topic)
    for index, control in enumerate(spec.control if declared else ()):
        if control.by not in declared:
            continue
        for place, robot in enumerate(control.of):
            command = context.command_topics.get(robot)
            if command is None or spec.programs[control.by].use is not None:  # AUTH010 reports these
                continue
            if command.topic not in declared[control.by]:
                yield Diagnostic(
                    "AUTH005",
                    f"`{control.by}` commands robot `{robot}`, but does not publish `{command.topic}`",
                    context.span("control", index, "of", place),
                    label="receives no commands",
                    notes=(Note(context.span("programs", control.by, "publishes", key=True), "its topics"),),
                    help=(f"add {{topic: {command.topic}, type: {command.type}}} there, or remap to it",),
                )


@rule("AUTH006")
def commanders_without_ros(context: RuleContext) -> Iterator[Diagnostic]:
    """A commander on a host that runs no ROS."""
    for index, control in enumerate(context.spec.control if context.islands else ()):
        host = context.commander_host(control.by)
        if host is not None and host in context.spec.hosts and host not in context.home:
            yield Diagnostic(
                "AUTH006",
                f"`{control.by}` cannot command: host `{host}` runs no ROS",
                context.span("control", index, "by"),
                label="in mode `single-minded` only the leader runs ROS",
                help=("make the leader the commander, or choose another mode",),
            )


@rule("AUTH007")
def ambiguous_commanders(context: RuleContext) -> Iterator[Diagnostic]:
    """A commander's name belongs to two things on different hosts."""
    spec = context.spec
    for index, control in enumerate(spec.control):
        kinds = [kind for kind in ("programs", "robots", "hosts") if control.by in getattr(spec, kind)]
        if len(kinds) < 2 or context.commander_host(control.by) == control.by:
            continue
        first, second = (kind[:-1] for kind in kinds[:2])
        yield Diagnostic(
            "AUTH007",
            f"`by: {control.by}` is ambiguous: it is a {first} and a {second}",
            context.span("control", index, "by"),
            label="on different hosts",
            notes=tuple(
                Note(context.span(kind, control.by, key=True), f"the {kind[:-1]}") for kind in kinds[:2]
            ),
            help=("rename one of the two",),
        )


@rule("AUTH008")
def unarbitrated_commanders(context: RuleContext) -> Iterator[Diagnostic]:
    """Several commanders of a robot whose driver does not arbitrate; one finding per robot."""
    spec = context.spec
    ungated = {name for name, one in context.ros_drivers.items() if one.ungated}
    first: dict[str, tuple[str, int, int]] = {}
    reported: set[str] = set()
    for index, control in enumerate(spec.control if ungated else ()):
        for place, robot in enumerate(control.of):
            if robot not in ungated or robot in reported:
                continue
            by, other, there = first.setdefault(robot, (control.by, index, place))
            if by == control.by:
                continue
            reported.add(robot)
            yield Diagnostic(
                "AUTH008",
                f"robot `{robot}` executes commands of `{by}` and `{control.by}`, ignoring priorities",
                context.span("control", index, "of", place),
                label="its driver is ungated and accepts every publisher",
                notes=(Note(context.span("control", other, "of", there), "another commander"),),
                help=(f"remove `ungated` from the driver of `{robot}`, so that swarmctl's gate arbitrates",),
            )


@rule("AUTH010")
def impossible_commands(context: RuleContext) -> Iterator[Diagnostic]:
    """An entry of `control` for a robot that takes no commands, or none of the kind its commander sends."""
    for index, control in enumerate(context.spec.control):
        program = context.spec.programs.get(control.by)
        for place, robot in enumerate(control.of):
            command = context.command_topics.get(robot)
            if command is None:
                message = f"`{control.by}` cannot command robot `{robot}`: it takes no commands"
                label = "its kinematics is `none`"
                help_line = "remove it here, or declare how it moves under `kinematics` of its type"
            elif program is not None and program.use is not None and command.type not in SENDABLE:
                message = (
                    f"`{program.use}` cannot command robot `{robot}`: it takes {command.type}, not velocities"
                )
                label = f"on `{command.topic}`"
                help_line = "command it by a program of your own that publishes this type"
            else:
                continue
            yield Diagnostic(
                "AUTH010",
                message,
                context.span("control", index, "of", place),
                label=label,
                notes=(Note(context.span("robots", robot, key=True), f"robot `{robot}`"),),
                help=(help_line,),
            )


@rule("AUTH011", needs="node-hosts")
def commanding_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """A program whose nodes have unknown names commands: all nodes of its host may; one finding per entry."""
    spec = context.spec
    ungated = {name for name, one in context.ros_drivers.items() if one.ungated}
    for index, control in enumerate(spec.control):
        program, host = spec.programs.get(control.by), context.program_hosts.get(control.by)
        if program is None or program.names_its_node or host is None:
            continue
        named = [one for one in control.of if one not in ungated and not _commands_anyway(context, host, one)]
        if not named:
            continue
        kind = program.kinds[0]
        others = f" and {len(named) - 1} more" if len(named) > 1 else ""
        yield Diagnostic(
            "AUTH011",
            f"every node on host `{host}` may command `{named[0]}`{others}, not only `{control.by}`",
            context.span("control", index, "by"),
            label="the names of its nodes are not known",
            notes=(
                Note(
                    context.span("programs", control.by, kind, key=True),
                    f"a `{kind}` names its nodes itself",
                ),
            ),
            help=(
                "run the node that sends the commands as a program with `package` and `executable`",
                f"if every node there may command, write `by: {host}`",
            ),
        )


def _commands_anyway(context: RuleContext, host: str, robot: str) -> bool:
    """Whether `control` lets all nodes of ``host`` command ``robot``."""
    return any(control.by == host and robot in control.of for control in context.spec.control)


def checks_commanders(context: RuleContext, robot: str) -> bool:
    """True if the driver of ``robot``, or the gate in front of it, rejects commands of others."""
    return robot not in context.ros_drivers or robot in context.gated


def _names_hosts(context: RuleContext, host: str | None) -> bool:
    """True if the graph in which the nodes of ``host`` are has the host of each node."""
    own = middleware_of(context.distro_of_host(host))
    return _all_name_hosts(context) or "node-hosts" in own.capabilities


def _all_name_hosts(context: RuleContext) -> bool:
    return all("node-hosts" in one.capabilities for one in context.distros.values())


@rule("AUTH012")
def unrecognised_commanders(context: RuleContext) -> Iterator[Diagnostic]:
    """A host commands, or a program whose nodes have unknown names, and the graph has no hosts of nodes."""
    spec = context.spec
    for index, control in enumerate(spec.control if not _all_name_hosts(context) else ()):
        program = spec.programs.get(control.by)
        named = control.by in spec.robots or (program is not None and program.names_its_node)
        by = context.commander_host(control.by)
        checking = [robot for robot in control.of if not named and checks_commanders(context, robot)]
        ends = [(robot, one) for robot in checking for one in (context.driving.get(robot), by)]
        failing = {robot: host for robot, host in ends if not _names_hosts(context, host)}
        if not failing:
            continue
        robot, host = next(iter(failing.items()))
        who = (
            "no robot recognises" if len(failing) == len(checking) else f"robot `{robot}` does not recognise"
        )
        here = [name for name, host in context.program_hosts.items() if host == control.by]
        able = [name for name in here if spec.programs[name].names_its_node]
        yield Diagnostic(
            "AUTH012",
            f"{who} `{control.by}` as its commander: "
            f"a graph of `{context.distro_of_host(host)}` has the names of nodes, not their hosts",
            context.span("control", index, "by"),
            label="a host" if program is None else "its nodes have names of their own",
            help=(
                f"name the program that commands: by: {able[0] if able else 'PROGRAM'}"
                if program is None
                else "run the node that sends the commands as a program with `package` and `executable`",
            ),
        )


@rule("AUTH013")
def robots_without_commanders(context: RuleContext) -> Iterator[Diagnostic]:
    """The leader commands, which no entry of `control` names, and the graph has no hosts of nodes."""
    named = {robot for control in context.spec.control for robot in control.of}
    left = [
        robot
        for robot in context.command_topics
        if robot not in named
        and not _names_hosts(context, context.driving[robot])
        and context.authority.leader_of(robot) is not None
        and checks_commanders(context, robot)
    ]
    if left:
        more = f" and {len(left) - 1} more" if len(left) > 1 else ""
        yield Diagnostic(
            "AUTH013",
            f"no node may command robot `{left[0]}`{more}: `control` names no commander",
            context.span("robots", left[0], key=True),
            label="does not move",
            help=(f"add to `control`: {{by: PROGRAM, of: [{', '.join(left)}]}}",),
        )
