"""ROS names are valid (wiki.ros.org/Names); every robot has its namespace, every node its name."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Edit, Fix, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.rules.topics import of_robots
from swarmctl.spec.program_model import Program
from swarmctl.suggest import nearest
from swarmctl.swarm import names
from swarmctl.yamltext.edits import make_fix, rename_key, replace_value
from swarmctl.yamltext.source import Loc


def _graph_names(context: RuleContext) -> Iterator[tuple[str, Loc, bool]]:
    """Yields every ROS name in the spec, its place, and whether it is a key."""
    for kind in ("robots", "programs"):
        for name, one in getattr(context.spec, kind).items():
            if one.namespace is not None:
                yield one.namespace, (kind, name, "namespace"), False
    for name, program in context.spec.programs.items():
        yield from _names_of(program, "programs", name)
    used = {id(one) for one in context.ros_drivers.values()}
    for loc, declared in of_robots(context):
        if isinstance(declared, RosDriver) and id(declared) in used:
            yield from _names_of(declared, *loc)
    for index, crossing in enumerate(context.spec.multimaster.topics if context.spec.multimaster else ()):
        yield crossing.topic, ("multimaster", "topics", index, "topic"), False


def _names_of(one: Program | RosDriver, *loc: str | int) -> Iterator[tuple[str, Loc, bool]]:
    for key in ("publishes", "subscribes"):
        for index, topic in enumerate(getattr(one, key)):
            yield topic.topic, (*loc, key, index, "topic"), False
    for key in ("provides", "calls"):
        for index, service in enumerate(getattr(one, key, ())):
            yield service.name, (*loc, key, index, "name"), False
    for old, new in one.remap.items():
        yield old, (*loc, "remap", old), True
        yield new, (*loc, "remap", old), False


@rule("NAME001")
def spelling(context: RuleContext) -> Iterator[Diagnostic]:
    """A name with an empty part, or with no part."""
    for name, loc, is_key in _graph_names(context):
        meant = _cleaned(name)
        if meant != name:
            yield Diagnostic(
                "NAME001",
                f"`{name}` is not a valid topic name",
                context.span(*loc, key=is_key),
                label=_flaw(name, meant),
                help=(f"write `{meant}`",) if meant else ("add a name after it",),
                fix=_respelt(context, loc, is_key, meant) if meant else None,
            )


@rule("NAME001", needs="domains")
def digits(context: RuleContext) -> Iterator[Diagnostic]:
    """A name with a part that begins with a digit, which ROS 2 refuses."""
    for name, loc, is_key in _graph_names(context):
        part = next((one for one in name.split("/") if one[:1].isdigit()), None)
        if part is not None and loc[0] != "multimaster":  # its publisher may be of ROS 1
            yield Diagnostic(
                "NAME001",
                f"`{name}` is not a valid name of ROS 2: `{part}` begins with a digit",
                context.span(*loc, key=is_key),
                label="the node ends with an error",
                help=("begin each part with a letter or `_`, here and in the node",),
            )


def _cleaned(name: str) -> str:
    """Returns ``name`` without empty parts; the empty text if no part is left."""
    head = name[0] if name[0] in "/~" else ""
    parts = [part for part in name[len(head) :].split("/") if part]
    return head + "/".join(parts) if parts else ""


def _flaw(name: str, meant: str) -> str:
    if not meant:
        return "no name"
    return "ends in `/`" if name.endswith("/") else "an empty part"


def _respelt(context: RuleContext, loc: Loc, is_key: bool, name: str) -> Fix | None:
    change = rename_key if is_key else replace_value
    edits: tuple[Edit, ...] = change(context.source, loc, name)
    return make_fix(f"write `{name}`", edits, safe=True)


@rule("NAME007")
def crossing_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A bridged topic with a relative name."""
    for index, crossing in enumerate(context.spec.multimaster.topics if context.spec.multimaster else ()):
        if crossing.topic[0] == "/":
            continue
        loc = ("multimaster", "topics", index, "topic")
        full = None if crossing.topic[0] == "~" else f"/{crossing.topic}"
        yield Diagnostic(
            "NAME007",
            f"`{crossing.topic}` is not an absolute topic name",
            context.span(*loc),
            label="relative name",
            help=(f"write `{full}`" if full else "write it with a leading `/`: /node/topic",),
            fix=make_fix(f"write `{full}`", replace_value(context.source, loc, full), safe=False)
            if full
            else None,
        )


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


@rule("NAME004", "NAME005", needs="master")
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


@rule("NAME012", names=True)
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
    own = _own_namespaces(context, robot, other)
    shown = " and ".join(f"`{one[1:]}`" for one in own.values())
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
        help=(f"give each robot its own, such as {shown}",),
        fix=_own_namespace(context, place, own[place]),
    )


def _own_namespace(context: RuleContext, robot: str, space: str) -> Fix | None:
    """Returns the fix that gives a robot a namespace; None if that is not apart from those of others."""
    others = [one for name, one in context.namespaces.items() if name != robot]
    if any(one == space or one in names.above(space) or space in names.above(one) for one in others):
        return None
    edits = replace_value(context.source, ("robots", robot, "namespace"), space[1:])
    return make_fix(f"write `namespace: {space[1:]}`", edits, safe=False)


def _own_namespaces(context: RuleContext, robot: str, other: str) -> dict[str, str]:
    """Returns two namespaces beside each other, below the one that holds both robots."""
    space = min((context.namespaces[one] for one in (robot, other)), key=len).rpartition("/")[0]
    return {one: space + names.robot_namespace(one, None) for one in sorted((robot, other))}


@rule("NAME009")
def undeclared_remaps(context: RuleContext) -> Iterator[Diagnostic]:
    """A remap of a name that the program, which declares its topics, does not declare.

    Services are remapped too, and need not be declared: the name must look misspelt, or become a known topic.
    """
    common = context.common_topics
    known: set[str] = {one.topic for one in context.endpoints}
    for name, program in context.spec.programs.items():
        topics = [
            *(one.topic for one in (*program.publishes, *program.subscribes)),
            *(one.name for one in (*program.provides, *program.calls)),
        ]
        node = context.program_nodes[name]
        own = {names.resolved(one, node, {}): one for one in topics}
        for old, new in program.remap.items() if own else ():
            before, after = (names.resolved(one, node, {}) for one in (old, new))
            misspelt = "//" in old or old.endswith("/")  # NAME001
            if (
                misspelt
                or before == after
                or {before, after} & own.keys()
                or before in common
                or old.startswith("~")
            ):
                continue
            near = nearest(old, tuple(one for one in topics if one not in program.remap))
            if near is None and after not in known and context.publishers.sensed(after) is None:
                continue
            loc = ("programs", name, "remap", old)
            yield Diagnostic(
                "NAME009",
                f"program `{name}` remaps `{old}`, which is none of its topics",
                context.span(*loc, key=True),
                label="not under `publishes` or `subscribes`",
                help=(
                    f"did you mean `{near}`?"
                    if near
                    else "write the name that the node itself uses, or add it to `publishes` or `subscribes`",
                ),
                fix=make_fix(f"write `{near}`", rename_key(context.source, loc, near), safe=False)
                if near
                else None,
            )


@rule("NAME010", needs="ros1-nodes")
def remap_chains(context: RuleContext) -> Iterator[Diagnostic]:
    """A remap to a name that another remap of the program changes."""
    for name, program in context.spec.programs.items():
        node = context.program_nodes[name]
        changed = {names.resolved(old, node, {}): old for old in program.remap}
        swapped: set[str] = set()
        for old, new in program.remap.items():
            after = names.resolved(new, node, {})
            second = changed.get(after)
            if second is None or second == old or old in swapped:
                continue
            end = names.resolved(program.remap[second], node, {})
            swap = end == names.resolved(old, node, {})
            swapped |= {second} if swap else set()
            loc = ("programs", name, "remap")
            yield Diagnostic(
                "NAME010",
                f"program `{name}` remaps `{old}` to `{new}`, and `{second}` to `{program.remap[second]}`",
                context.span(*loc, old),
                label="names that are swapped" if swap else "this name is remapped again",
                notes=(Note(context.span(*loc, second), "the second remap"),),
                help=("remap each name to its final one: roscpp changes names once, rospy sometimes twice",),
            )
