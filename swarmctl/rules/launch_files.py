"""Launch files: roslaunch accepts them, and what they start fits the swarm."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Span, note_of_other
from swarmctl.linter.context import RuleContext, rule
from swarmctl.linter.launch_uses import LaunchUse, declared_launches
from swarmctl.ros_packages.launch_files import Fault, Refusal
from swarmctl.suggest import did_you_mean, guess
from swarmctl.swarm import names
from swarmctl.swarm.names import driver_node, resolved
from swarmctl.yamltext.edits import make_fix, remove, rename_key, replace_value, set_key
from swarmctl.yamltext.source import Loc


@rule("PKG004", "PKG005", "PKG006", "PKG007", needs="launch-xml")
def accepted(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file that roslaunch refuses, or a part of which it skips."""
    seen: set[tuple[Span, Refusal, str]] = set()  # robots of one type have its driver's faults once
    for use in context.launches:
        place = context.launch_span(use, "launch")
        for fault in use.launched.faults:
            if (place, fault.kind, fault.subject) not in seen:
                seen.add((place, fault.kind, fault.subject))
                yield _finding(context, use, fault)


def _finding(context: RuleContext, use: LaunchUse, fault: Fault) -> Diagnostic:
    key, given = use.started.named_values
    param = fault.subject if fault.subject in given else None
    span = context.launch_span(use, "launch")
    if fault.kind is Refusal.UNUSED and not fault.place.line and param is not None:
        return _unused(context, use, key, fault)
    if fault.kind is Refusal.UNUSED:
        return Diagnostic(
            "PKG005",
            f"{fault.place} passes the argument `{fault.subject}`: {fault.text}",
            span,
            label="roslaunch stops: unused args",
            help=did_you_mean(fault.subject, fault.known, "it declares"),
        )
    if fault.kind is Refusal.FIXED and param is not None:
        return Diagnostic(
            "PKG005",
            f"`{param}` cannot be given to the launch file of {use.owner}: {fault.text} ({fault.place})",
            context.launch_span(use, key, param, is_key=True),
            label="cannot override",
            help=("remove it here", "or write `default` instead of `value` in the launch file"),
        )
    if fault.kind is Refusal.MISSING:
        return Diagnostic(
            "PKG006",
            f"the launch file of {use.owner} needs the argument `{fault.subject}` ({fault.place})",
            span,
            label=f"`{fault.subject}` is not given",
            help=(
                f"write it under `{key}`: {{{fault.subject}: VALUE}}",
                "or give it a `default` in the launch file",
            ),
        )
    if fault.kind is Refusal.SKIPPED:
        return Diagnostic(
            "PKG007",
            f"{fault.text} ({fault.place})",
            span,
            label="a part of it is not started",
            help=did_you_mean(fault.subject, _ELEMENTS, "it knows"),
        )
    return Diagnostic(
        "PKG004",
        f"roslaunch cannot read {fault.place}: {fault.text}",
        span,
        label="it does not start",
        help=did_you_mean(fault.subject, fault.known, "files of that package")
        or ("`roslaunch --nodes PACKAGE FILE` shows its own message",),
    )


_ELEMENTS = ("arg", "env", "group", "include", "machine", "node", "param", "remap", "rosparam", "test")


def _unused(context: RuleContext, use: LaunchUse, key: str, fault: Fault) -> Diagnostic:
    meant = guess(fault.subject, fault.known)
    near = meant.only
    free = near is not None and near not in use.started.arguments and not use.of_type
    of_namespace = fault.subject == use.started.namespace_argument
    place = ("namespace_argument",) if of_namespace else (key, fault.subject)
    loc: Loc = (*use.loc, *place)
    renamed = replace_value if of_namespace else rename_key
    return Diagnostic(
        "PKG005",
        f"the launch file of {use.owner} has no argument `{fault.subject}` ({fault.place})",
        context.launch_span(use, *place, is_key=not of_namespace),
        label="roslaunch stops: unused args",
        help=did_you_mean(fault.subject, fault.known, "it declares") or ("it declares no arguments",),
        fix=make_fix(f"write `{near}`", renamed(context.source, loc, near), safe=meant.certain)
        if near and free
        else None,
    )


_MOST_NAMED = 20  # packages in one message


@rule("PKG008", needs="master")
def node_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A node of a launch file that has the name of another node under the same master."""
    taken: dict[tuple[str, str], tuple[str, Span]] = {}
    for master, node, owner, loc in named_nodes(context) if context.launches else ():
        taken.setdefault((master, node), (owner, context.span(*loc, key=True)))
    for use in context.launches:
        island = context.home.get(use.host or "")
        for one in use.launched.nodes if island is not None else ():
            if one.name is None or not one.certain or island is None:
                continue
            span = context.launch_span(use, "launch")
            own = f"{use.owner} ({one.place})"
            owner, place = taken.setdefault((island.name, one.name), (own, span))
            if owner != own:
                started = f"starts a node `{one.name}` ({one.place})"
                yield Diagnostic(
                    "PKG008",
                    f"{use.owner} {started}, a name that {owner} has",
                    span,
                    label="the older node is shut down",
                    notes=note_of_other(place, span),
                    help=(
                        "remove the leading `/` of its name or `ns`: then it follows the robot's namespace"
                        if use.is_driver
                        else "run it in the namespace of its robot: robot: ...",
                        "or give the node another name in the launch file",
                    ),
                )


def named_nodes(context: RuleContext) -> Iterator[tuple[str, str, str, Loc]]:
    """Yields the nodes whose names the spec gives: the island, the node, whose it is, and its place."""
    for robot, space in context.namespaces.items():
        island, foreign = context.island_of_robot(robot), context.ros_drivers.get(robot)
        loc = ("robots", robot)
        if island is not None and (foreign is None or foreign.launch is None):
            yield island.name, names.driver_node(space), f"the driver of robot `{robot}`", loc
        if island is not None and robot in context.gated:
            yield island.name, names.gate_node(space), f"the gate of robot `{robot}`", loc
    for name, program in context.spec.programs.items():
        island = context.home.get(context.program_hosts[name] or "")
        if island is not None and program.names_its_node:
            yield island.name, context.program_nodes[name], f"program `{name}`", ("programs", name)


@rule("PKG009", needs="launch-xml")
def undeclared_packages(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file names packages that neither its package.xml nor the spec declares."""
    packages, seen = context.document.packages.by_name, set()
    for use in context.launches:
        span = context.launch_span(use, "launch")
        declared = {*use.requires, *packages}
        for package in (use.started.package or "", *use.launched.packages):
            if package in packages:
                declared |= packages[package].depends
        missing = [one for one in use.launched.packages if one not in declared]
        if missing and span not in seen:
            seen.add(span)
            who = "driver" if use.is_driver else "program"
            place, named = use.launched.packages[missing[0]], missing[:_MOST_NAMED]
            more = f" and {len(missing) - len(named)} more" if len(missing) > len(named) else ""
            listed = ", ".join(f"`{one}`" for one in named) + more
            yield Diagnostic(
                "PKG009",
                f"the launch file of {use.owner} uses undeclared packages: {listed} ({place})",
                span,
                label="may be missing on the host",
                help=(
                    f"add it to the {who}: requires: [{', '.join(named)}]",
                    "or as <exec_depend> to package.xml",
                ),
            )


@rule("PKG010", needs="master")
def identities(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file sets a variable that swarmctl sets for every host."""
    for use in context.launches:
        for one in use.launched.environment:
            if one.name in context.middleware.variables:
                yield Diagnostic(
                    "PKG010",
                    f"the launch file of {use.owner} sets `{one.name}` ({one.place})",
                    context.launch_span(use, "launch"),
                    label="overrides what swarmctl sets for the host",
                    help=("remove the <env>; swarmctl derives it from the host's address and the mode",),
                )


@rule("PKG011", needs="launch-xml")
def other_machines(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file that starts nodes on other hosts, or a master."""
    for use in context.launches:
        for tag, places in (
            ("machine", [one.place for one in use.launched.machines]),
            ("master", use.launched.masters),
        ):
            for place in places[:1]:
                yield Diagnostic(
                    "PKG011",
                    f"the launch file of {use.owner} has a <{tag}> ({place})",
                    context.launch_span(use, "launch"),
                    label="starts nodes by SSH, outside of the swarm"
                    if tag == "machine"
                    else "roslaunch ignores it",
                    help=("write one program for each host, with its own launch file",)
                    if tag == "machine"
                    else ("remove it; swarmctl starts the masters",),
                )


# Arguments with which launch files set apart the frames of equal robots.
_FRAMES = re.compile(r"(tf|frame|frames|frame_id|link|robot_frame)_?prefix|multi_robot_name", re.I)


@rule("PKG020", needs="launch-xml")
def shared_frames(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots under one master start a launch file with the same value of an argument for frames."""
    first: dict[tuple[str, str, str, str, str], LaunchUse] = {}
    reported: set[tuple[str, str, str]] = set()
    for use in context.launches:
        island = context.home.get(use.host or "")
        for name, value in use.launched.arguments.items() if island and use.robot else ():
            if value is None or island is None or not _FRAMES.fullmatch(name):
                continue
            file = (island.name, use.started.package or "", use.started.launch or "")
            earlier = first.setdefault((*file, name, value), use)
            if earlier.robot == use.robot or file in reported:
                continue
            reported.add(file)
            span, other = context.launch_span(use, "launch"), context.launch_span(earlier, "launch")
            placeholder = "{frame}" if use.is_driver else "{namespace}"
            shared = f"`{name}: {value}`" if value else f"no `{name}`"
            yield Diagnostic(
                "PKG020",
                f"{earlier.owner} and {use.owner} start one launch file with {shared}",
                span,
                label="their frames have the same names",
                notes=note_of_other(other, span),
                help=(f'set them apart: args: {{{name}: "{placeholder}"}}',),
            )


@rule("PKG022", needs="launch-xml")
def commands_past_the_gate(context: RuleContext) -> Iterator[Diagnostic]:
    """The launch file of a gated driver remaps its command topic itself, so the node ignores the gate."""
    seen = set()
    for use in context.launches:
        if not use.is_driver or use.name not in context.gated:
            continue
        driver, span = context.ros_drivers[use.name], context.launch_span(use, "launch")
        command = resolved(driver.command, driver_node(use.namespace), {})
        for node in use.launched.nodes:
            for old, new in node.remaps if node.certain and node.name is not None else ():
                after = resolved(new, node.name or "", {})
                if resolved(old, node.name or "", {}) != command or after == command:
                    continue
                if (span, node.place) not in seen:
                    seen.add((span, node.place))
                    yield Diagnostic(
                        "PKG022",
                        f"the launch file of {use.owner} remaps `{driver.command}` to `{new}` ({node.place})",
                        span,
                        label="its node takes commands from there, not from the gate",
                        help=(
                            "remove that <remap>: swarmctl remaps the command topic to the gate",
                            "or write `ungated: true` with a `reason`",
                        ),
                    )


_NAMESPACE = "namespace"  # the argument by which launch files put their nodes into a namespace


@rule("PKG023", needs="launched")
def namespaces_twice(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file that puts its nodes into a namespace, within the one that swarmctl puts around it."""
    read, seen = {use.owner: use.launched.nodes for use in context.launches}, set()
    for use, arguments in declared_launches(context):
        around, given = use.started.namespace_around(use.namespace), arguments.get(_NAMESPACE)
        key, values = use.started.named_values
        span = context.launch_span(use, key, _NAMESPACE, is_key=True)
        if not around or not given or given.startswith("/") or span in seen:
            continue
        below, nodes = f"/{around}/{given}", read.get(use.owner)
        if nodes is not None and not any((one.name or "").startswith(f"{below}/") for one in nodes):
            continue
        seen.add(span)
        given_loc: Loc = (*use.loc, key, _NAMESPACE) if len(values) > 1 else (*use.loc, key)
        moved = (
            set_key(context.source, use.loc, "namespace_argument", _NAMESPACE, after="launch"),
            remove(context.source, given_loc),
        )
        yield Diagnostic(
            "PKG023",
            f"{use.owner} is in the namespace `{around}`, and its argument `{_NAMESPACE}` adds `{given}`",
            span,
            label=f"its nodes get names such as `{below}/NODE`",
            help=(f"write `namespace_argument: {_NAMESPACE}` instead: then the file alone sets it",),
            fix=make_fix(f"replace it by `namespace_argument: {_NAMESPACE}`", *moved, safe=True)
            if given == around and not use.of_type
            else None,
        )
