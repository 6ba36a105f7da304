"""What launch files start fits the swarm: names of nodes, hosts, the environment, packages."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.programs.declarations import IDENTITY
from swarmctl.swarm import names
from swarmctl.yamltext.source import Loc


@rule("PKG008", ros1=True)
def node_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A node of a launch file that has the name of another node under the same master."""
    taken: dict[tuple[str, str], tuple[str, Loc]] = {}
    for robot in context.spec.robots if context.launches else ():
        island = context.island_of_robot(robot)
        if island is not None:
            owner = f"the driver of robot `{robot}`"
            taken[island.name, names.driver_node(robot)] = owner, ("robots", robot)
    for name, program in context.spec.programs.items() if context.launches else ():
        island = context.home.get(context.program_hosts[name] or "")
        if island is not None and program.launch is None:
            node = names.program_node(name, program.robot)
            taken.setdefault((island.name, node), (f"program `{name}`", ("programs", name)))
    for name, launched in context.launches.items():
        island = context.home.get(context.program_hosts[name] or "")
        for one in launched.nodes if island is not None else ():
            if one.name is None or not one.certain or island is None:
                continue
            own = f"program `{name}` ({one.place})"
            owner, loc = taken.setdefault((island.name, one.name), (own, ("programs", name)))
            if owner != own:
                yield Diagnostic(
                    "PKG008",
                    f"program `{name}` starts a node `{one.name}` ({one.place}), a name that {owner} has",
                    context.span("programs", name, "launch"),
                    label="the older node is shut down",
                    notes=(Note(context.span(*loc, key=True), "the other one"),) if loc[1] != name else (),
                    help=(
                        "run it in the namespace of its robot: robot: ...",
                        "or give the node another name in the launch file",
                    ),
                )


@rule("PKG009", ros1=True)
def undeclared_packages(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file names packages that neither its package.xml nor the spec declares."""
    packages = context.document.packages.by_name
    for name, launched in context.launches.items():
        program = context.spec.programs[name]
        declared = {*program.requires, *packages}
        for package in (program.package or "", *launched.packages):
            if package in packages:
                declared |= packages[package].depends
        missing = [one for one in launched.packages if one not in declared]
        if missing:
            listed, place = ", ".join(f"`{one}`" for one in missing), launched.packages[missing[0]]
            yield Diagnostic(
                "PKG009",
                f"the launch file of program `{name}` uses undeclared packages: {listed} ({place})",
                context.span("programs", name, "launch"),
                label="may be missing on the host",
                help=(
                    f"add it to the program: requires: [{', '.join(missing)}]",
                    "or as <exec_depend> to package.xml",
                ),
            )


@rule("PKG010", ros1=True)
def identities(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file sets a variable that swarmctl sets for every host."""
    for name, launched in context.launches.items():
        for one in launched.environment:
            if one.name in IDENTITY:
                yield Diagnostic(
                    "PKG010",
                    f"the launch file of program `{name}` sets `{one.name}` ({one.place})",
                    context.span("programs", name, "launch"),
                    label="overrides what swarmctl sets for the host",
                    help=("remove the <env>; swarmctl derives it from the host's address and the mode",),
                )


@rule("PKG011", ros1=True)
def other_machines(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file that starts nodes on other hosts, or a master."""
    for name, launched in context.launches.items():
        for tag, places in (
            ("machine", [one.place for one in launched.machines]),
            ("master", launched.masters),
        ):
            for place in places[:1]:
                yield Diagnostic(
                    "PKG011",
                    f"the launch file of program `{name}` has a <{tag}> ({place})",
                    context.span("programs", name, "launch"),
                    label="starts nodes by SSH, outside of the swarm"
                    if tag == "machine"
                    else "roslaunch ignores it",
                    help=("write one program for each host, with its own launch file",)
                    if tag == "machine"
                    else ("remove it; swarmctl starts the masters",),
                )
