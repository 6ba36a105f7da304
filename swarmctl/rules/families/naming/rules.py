"""ROS names: valid and unique (wiki.ros.org/Names)."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Edit, Fix
from swarmctl.rules.context import RuleContext, rule
from swarmctl.yamltext.edits import make_fix, rename_key, replace_value
from swarmctl.yamltext.source import Loc

_CONVENTIONAL = re.compile("[a-z][a-z0-9_]*", re.ASCII)  # REP 144


def _graph_names(context: RuleContext) -> Iterator[tuple[str, Loc, bool]]:
    """Yields every ROS name in the spec, its place, and whether it is a key."""
    for kind in ("robots", "programs"):
        for name, one in getattr(context.spec, kind).items():
            if one.namespace is not None:
                yield one.namespace, (kind, name, "namespace"), False
    for program_name, program in context.spec.programs.items():
        for key in ("publishes", "subscribes"):
            for index, topic in enumerate(getattr(program, key)):
                yield topic.topic, ("programs", program_name, key, index, "topic"), False
        for old, new in program.remap.items():
            yield old, ("programs", program_name, "remap", old), True
            yield new, ("programs", program_name, "remap", old), False
    for index, crossing in enumerate(context.spec.multimaster.topics if context.spec.multimaster else ()):
        yield crossing.topic, ("multimaster", "topics", index, "topic"), False


@rule("NAME001", "NAME002")
def spelling(context: RuleContext) -> Iterator[Diagnostic]:
    """A name that is invalid in ROS 1, or in ROS 2."""
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
        elif "__" in name:
            yield Diagnostic(
                "NAME002",
                f"`{name}` has two underscores in a row",
                context.span(*loc, key=is_key),
                label="ROS reserves `__`",
                help=("write one underscore",),
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


@rule("NAME003")
def trailing_hyphens(context: RuleContext) -> Iterator[Diagnostic]:
    """A name that ends in a hyphen or has two in a row; hyphens become underscores in ROS."""
    spec = context.spec
    named: list[tuple[str, Loc, bool]] = [(spec.name, ("name",), False)]
    for kind in ("hosts", "robots", "programs", "islands"):
        named += [(name, (kind, name), True) for name in getattr(spec, kind) if "-" in name]
    for name, loc, is_key in named:
        if name.endswith("-") or "--" in name:
            yield Diagnostic(
                "NAME003",
                f"`{name}` {'ends in a hyphen' if name.endswith('-') else 'has two hyphens in a row'}",
                context.span(*loc, key=is_key),
                label="hyphens become underscores in ROS names",
                help=(f"write `{'-'.join(part for part in name.split('-') if part)}`",),
            )


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


@rule("NAME008", ros1=True)
def package_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A package with a name that catkin takes with a warning."""
    for name, program in context.spec.programs.items():
        named: list[tuple[str, Loc]] = [
            (one, ("programs", name, "requires", index)) for index, one in enumerate(program.requires)
        ]
        if program.package is not None:
            named.insert(0, (program.package, ("programs", name, "package")))
        for package, loc in named:
            if _CONVENTIONAL.fullmatch(package):
                continue
            meant = re.sub("[^a-z0-9]+", "_", package.lower()).lstrip("_0123456789")
            yield Diagnostic(
                "NAME008",
                f"the package name `{package}` is against the conventions of ROS",
                context.span(*loc),
                label="lower-case letters, digits and _, a letter first",
                help=(
                    *((f"write `{meant}`, if that is its name",) if meant else ()),
                    "compare it with the package's package.xml; `rospack find NAME` looks for it on a host",
                ),
            )
