"""ROS names: valid and unique (wiki.ros.org/Names)."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Edit, Fix
from swarmctl.rules.context import RuleContext, rule
from swarmctl.yamltext.edits import make_fix, rename_key, replace_value
from swarmctl.yamltext.source import Loc


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
