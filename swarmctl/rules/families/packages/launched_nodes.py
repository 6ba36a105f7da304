"""What launch files start fits the swarm: names of nodes, hosts, the environment, packages."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Span, note_of_other
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.programs.declarations import IDENTITY
from swarmctl.swarm import names
from swarmctl.yamltext.source import Loc

_MOST_NAMED = 20  # packages in one message


@rule("PKG008", ros1=True)
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


@rule("PKG009", ros1=True)
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


@rule("PKG010", ros1=True)
def identities(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file sets a variable that swarmctl sets for every host."""
    for use in context.launches:
        for one in use.launched.environment:
            if one.name in IDENTITY:
                yield Diagnostic(
                    "PKG010",
                    f"the launch file of {use.owner} sets `{one.name}` ({one.place})",
                    context.launch_span(use, "launch"),
                    label="overrides what swarmctl sets for the host",
                    help=("remove the <env>; swarmctl derives it from the host's address and the mode",),
                )


@rule("PKG011", ros1=True)
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
