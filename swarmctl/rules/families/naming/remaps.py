"""Remapped names: each changes a name that the node has, once."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.suggest import nearest
from swarmctl.swarm import names
from swarmctl.yamltext.edits import make_fix, rename_key


@rule("NAME009")
def undeclared_remaps(context: RuleContext) -> Iterator[Diagnostic]:
    """A remap of a name that the program, which declares its topics, does not declare.

    Services are remapped too, and are not declared: the name must look misspelt, or become a known topic.
    """
    common = context.middleware.topics
    known: set[str] = {one.topic for one in context.endpoints}
    for name, program in context.spec.programs.items():
        topics = [one.topic for one in (*program.publishes, *program.subscribes)]
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


@rule("NAME010", ros1=True)
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
