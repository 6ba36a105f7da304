"""Declared services and actions: provided where they are called, by one node, with one type."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.suggest import guess, suggestion
from swarmctl.swarm.services import ServiceEnd, service_ends
from swarmctl.yamltext.edits import make_fix, replace_value


@rule("SERVICE001", "SERVICE002", "SERVICE003", "SERVICE004")
def services(context: RuleContext) -> Iterator[Diagnostic]:
    """What is called has another type, or is not provided; what is provided has two providers."""
    ends = [one for one in service_ends(context) if one.island]
    provided: dict[str, list[ServiceEnd]] = {}
    for one in ends:
        if one.provides:
            provided.setdefault(one.name, []).append(one)
    open_ = _may_provide_others(context)
    for one in ends:
        others = provided.get(one.name, ())
        here = [other for other in others if other.island == one.island]
        if one.provides:
            yield from _second_provider(context, one, here)
        elif here:
            yield from _other_type(context, one, here[0])
        elif others:
            yield _elsewhere(context, one, others)
        else:
            yield from _nowhere(context, one, tuple(provided), certain=not open_)


def _may_provide_others(context: RuleContext) -> bool:
    """True if a program or a driver declares nothing that it provides, and so may provide anything."""
    programs = (one for one in context.spec.programs.values() if one.use is None and not one.calls)
    drivers = any(not one.provides for one in context.ros_drivers.values())
    return drivers or any(not one.provides for one in programs)


def _place(context: RuleContext, one: ServiceEnd) -> Span:
    """The name in the spec; the robot, if its type declares it."""
    return context.span(*one.loc, key=True) if len(one.loc) == 2 else context.span(*one.loc, "name")


def _second_provider(
    context: RuleContext, one: ServiceEnd, here: Sequence[ServiceEnd]
) -> Iterator[Diagnostic]:
    if here[0] is one or (one.optional and here[0].optional):
        return
    yield Diagnostic(
        "SERVICE004",
        f"{here[0].owner} and {one.owner} both provide `{one.name}`",
        _place(context, one),
        label="a second provider",
        notes=(Note(_place(context, here[0]), f"provided by {here[0].owner}"),),
        help=("give each its own name, by `remap` or its namespace",),
    )


def _other_type(context: RuleContext, one: ServiceEnd, other: ServiceEnd) -> Iterator[Diagnostic]:
    if one.type == other.type:
        return
    loc = (*one.loc, "type")
    yield Diagnostic(
        "SERVICE001",
        f"{one.owner} calls `{one.name}` as {one.type}, and {other.owner} provides {other.type}",
        context.span(*loc),
        label="another type",
        notes=(Note(_place(context, other), f"provided as {other.type}"),),
        help=("write the type that the provider's node has", "or call another service"),
        fix=make_fix(f"write `{other.type}`", replace_value(context.source, loc, other.type), safe=False),
    )


def _elsewhere(context: RuleContext, one: ServiceEnd, others: Sequence[ServiceEnd]) -> Diagnostic:
    return Diagnostic(
        "SERVICE003",
        f"{one.owner} on island `{one.island}` calls `{one.name}`, which is provided on `{others[0].island}`",
        _place(context, one),
        label="out of reach",
        notes=(Note(_place(context, others[0]), f"provided by {others[0].owner}"),),
        help=(
            f"run it on a host of island `{others[0].island}`: only topics are carried from island to island",
        ),
    )


def _nowhere(
    context: RuleContext, one: ServiceEnd, provided: Sequence[str], *, certain: bool
) -> Iterator[Diagnostic]:
    meant = guess(one.name, provided)
    if not certain and not meant.words:
        return
    loc = (*one.loc, "name")
    yield Diagnostic(
        "SERVICE002",
        f"{one.owner} calls `{one.name}`, which nobody provides",
        _place(context, one),
        label="waits forever without an error",
        help=(
            *suggestion(meant, (), ""),
            "correct the name, or declare it under `provides` of its program or driver",
        ),
        fix=make_fix(f"write `{meant.only}`", replace_value(context.source, loc, meant.only), safe=False)
        if meant.only
        else None,
    )
