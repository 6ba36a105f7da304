"""Namespaces and nodes: every robot has a namespace of its own, and every node a name of its own."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.swarm import names

# Nodes of the master and of multimasters. Multimasters exclude nodes by these names.
_ALWAYS_THERE = {
    "rosout": "every ROS master",
    "master_discovery": "multimaster",
    "master_sync": "multimaster",
    "node_manager": "multimaster",
    "node_manager_daemon": "multimaster",
    "param_sync": "multimaster",
    "zeroconf": "multimaster",
    "mas_discovery": "multimaster",
    "mas_sync": "multimaster",
    "mas_daemon": "multimaster",
}


@rule("NAME004", "NAME005", ros1=True)
def nodes(context: RuleContext) -> Iterator[Diagnostic]:
    """A program's node with the name of a driver or a gate, or of a node of ROS or swarmctl."""
    spec = context.spec
    for name, program in spec.programs.items():
        node = context.program_nodes[name]
        robot = context.robot_by_namespace.get(node.rpartition("/")[0])
        part = _part_of(context, robot, node) if robot is not None and program.names_its_node else None
        if part is not None:
            key = "namespace" if program.namespace is not None else "robot"
            yield Diagnostic(
                "NAME004",
                f"program `{name}` and the {part} of robot `{robot}` have one node name, `{node}`",
                context.span("programs", name, key=True),
                label="the master shuts down the older node",
                notes=(Note(context.span("programs", name, key), f"this robot's {part}"),),
                help=("rename the program",),
            )
    node_of = {"robots": context.namespaces, "programs": context.program_nodes}
    for kind, node_names in node_of.items():
        taken_by = {node: name for name, node in node_names.items()}
        for taken, whose in _ALWAYS_THERE.items():
            if (one := taken_by.get(f"/{taken}")) is not None:
                written = kind == "robots" and spec.robots[one].namespace is not None
                yield Diagnostic(
                    "NAME005",
                    f"the node name `/{taken}` is used by {whose}",
                    context.span(kind, one, "namespace") if written else context.span(kind, one, key=True),
                    label="reserved name",
                    help=("choose another name",),
                )


def _part_of(context: RuleContext, robot: str, node: str) -> str | None:
    """Returns what of ``robot`` has the node name ``node``: its driver, its gate, or nothing."""
    space = context.namespaces[robot]
    if node == names.driver_node(space):
        return "driver"
    return "gate" if robot in context.gated and node == names.gate_node(space) else None


@rule("NAME012")
def namespaces(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots in one namespace, or one within that of the other."""
    first: dict[str, str] = {}
    for robot, space in context.namespaces.items():
        other = first.setdefault(space, robot)
        if other != robot:
            yield _shared_namespace(context, robot, other, f"have one namespace, `{space}`")
    for space, robot in first.items():
        outer = next((one for one in names.above(space) if one in first), None)
        if outer is not None:
            text = f"have nested namespaces: `{space}` lies in `{outer}`"
            yield _shared_namespace(context, robot, first[outer], text)


def _shared_namespace(context: RuleContext, robot: str, other: str, text: str) -> Diagnostic:
    written = [one for one in (robot, other) if context.spec.robots[one].namespace is not None]
    place, rest = (robot, other) if robot in written else (other, robot)
    return Diagnostic(
        "NAME012",
        f"robots `{other}` and `{robot}` {text}",
        context.span("robots", place, "namespace"),
        label="their topics, nodes and commanders mix",
        notes=(
            Note(
                context.span("robots", rest, "namespace")
                if rest in written
                else context.span("robots", rest, key=True),
                "the other robot",
            ),
        ),
        help=("give each robot its own, such as " + _example(context, robot, other),),
    )


def _example(context: RuleContext, robot: str, other: str) -> str:
    """Returns two namespaces beside each other, below the one that holds both robots."""
    space = min((context.namespaces[one] for one in (robot, other)), key=len).rpartition("/")[0]
    both = (space + names.robot_namespace(one, None) for one in sorted((robot, other)))
    return " and ".join(f"`{one[1:]}`" for one in both)
