"""ROS names: written as ROS reads them, and none of them used twice (wiki.ros.org/Names)."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Edit, Fix, Note, Severity
from swarmctl.spec.edits import mend, remove, rename_key, replace_value
from swarmctl.spec.source import Loc
from swarmctl.topology import names


def _graph_names(case: Case) -> Iterator[tuple[str, Loc, bool]]:
    """Every ROS name in the spec: the name, where it stands, whether it is a key."""
    for program_name, program in case.spec.programs.items():
        for key in ("publishes", "subscribes"):
            for index, topic in enumerate(getattr(program, key)):
                yield topic.topic, ("programs", program_name, key, index, "topic"), False
        for old, new in program.remap.items():
            yield old, ("programs", program_name, "remap", old), True
            yield new, ("programs", program_name, "remap", old), False
    for index, crossing in enumerate(case.spec.multimaster.topics if case.spec.multimaster else ()):
        yield crossing.topic, ("multimaster", "topics", index, "topic"), False


def spelling(case: Case) -> Iterator[Diagnostic]:
    """NAME001, NAME002: a name that ROS refuses or reads otherwise, and one that ROS 2 will refuse."""
    for name, loc, is_key in _graph_names(case):
        meant = _cleaned(name)
        if meant != name:
            yield Diagnostic(
                "NAME001",
                f"`{name}` is no name of a topic",
                case.span(*loc, key=is_key),
                label=_flaw(name, meant),
                help=(f"write `{meant}`",) if meant else ("add the topic's own name",),
                fix=_respelt(case, loc, is_key, meant) if meant else None,
            )
        elif "__" in name:
            yield Diagnostic(
                "NAME002",
                f"`{name}` has two underscores in a row",
                case.span(*loc, key=is_key),
                severity=Severity.WARNING,
                label="ROS keeps `__` for itself",
                help=("write one underscore",),
            )


def _cleaned(name: str) -> str:
    """``name`` without empty parts; nothing if no part is left."""
    head = name[0] if name[0] in "/~" else ""
    parts = [part for part in name[len(head) :].split("/") if part]
    return head + "/".join(parts) if parts else ""


def _flaw(name: str, meant: str) -> str:
    if not meant:
        return "no name yet"
    return "nothing stands behind the last `/`" if name.endswith("/") else "an empty part"


def _respelt(case: Case, loc: Loc, is_key: bool, name: str) -> Fix | None:
    change = rename_key if is_key else replace_value
    edits: tuple[Edit, ...] = change(case.source, loc, name)
    return mend(f"write `{name}`", edits)


def trailing_hyphens(case: Case) -> Iterator[Diagnostic]:
    """NAME003: a name ends in a hyphen or has two in a row, which become underscores in ROS."""
    spec = case.spec
    named: list[tuple[str, Loc, bool]] = [(spec.name, ("name",), False)]
    for kind in ("hosts", "robots", "programs", "islands"):
        named += [(name, (kind, name), True) for name in getattr(spec, kind) if "-" in name]
    for name, loc, is_key in named:
        if name.endswith("-") or "--" in name:
            yield Diagnostic(
                "NAME003",
                f"`{name}` {'ends in a hyphen' if name.endswith('-') else 'has two hyphens in a row'}",
                case.span(*loc, key=is_key),
                severity=Severity.WARNING,
                label="easily misread, and refused elsewhere",
                help=(f"call it `{'-'.join(part for part in name.split('-') if part)}`",),
            )


def nodes(case: Case) -> Iterator[Diagnostic]:
    """NAME004, NAME005: no program's node has the name of a driver, or of a node that is always there."""
    spec = case.spec
    for name, program in spec.programs.items():
        node = names.program_node(name, program.robot)
        if program.robot is not None and node == names.driver_node(program.robot):
            yield Diagnostic(
                "NAME004",
                f"program `{name}` and the driver of robot `{program.robot}` would both be the node `{node}`",
                case.span("programs", name, key=True),
                label="ROS shuts down the older of the two",
                notes=(Note(case.span("programs", name, "robot"), "this robot's driver"),),
                help=("rename the program",),
            )
    for kind in ("robots", "programs"):
        for taken, whose in names.ALWAYS_THERE.items():
            word = taken.replace("_", "-")
            if word in getattr(spec, kind) and (kind == "robots" or spec.programs[word].robot is None):
                yield Diagnostic(
                    "NAME005",
                    f"`/{taken}` is a node of {whose}",
                    case.span(kind, word, key=True),
                    label="the name is taken",
                    help=("choose another name",),
                )


def remaps(case: Case) -> Iterator[Diagnostic]:
    """NAME006: a name that is changed into itself."""
    for name, program in case.spec.programs.items():
        node = names.program_node(name, program.robot)
        for old, new in program.remap.items():
            if names.resolved(old, node, {}) == names.resolved(new, node, {}):
                loc = ("programs", name, "remap", old)
                yield Diagnostic(
                    "NAME006",
                    f"program `{name}` changes `{old}` into itself",
                    case.span(*loc),
                    severity=Severity.WARNING,
                    label=f"both are `{names.resolved(old, node, {})}`",
                    help=("remove it, or write the other name",),
                    fix=mend("remove it", remove(case.source, loc)),
                )


def crossing_names(case: Case) -> Iterator[Diagnostic]:
    """NAME007: what crosses between islands has a full name, as no program's namespace is meant."""
    for index, crossing in enumerate(case.spec.multimaster.topics if case.spec.multimaster else ()):
        if crossing.topic[0] == "/":
            continue
        loc = ("multimaster", "topics", index, "topic")
        full = None if crossing.topic[0] == "~" else f"/{crossing.topic}"
        yield Diagnostic(
            "NAME007",
            f"`{crossing.topic}` is no full name of a topic",
            case.span(*loc),
            label="whose namespace?",
            help=(f"write `{full}`" if full else "write it from the root: /node/topic",),
            fix=mend(f"write `{full}`", replace_value(case.source, loc, full)) if full else None,
        )


RULES: tuple[Rule, ...] = (spelling, trailing_hyphens, nodes, remaps, crossing_names)
