"""roslaunch accepts the launch files of programs, with the arguments that the spec gives."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.ros_packages.launched import Fault, Refusal
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.launch_uses import LaunchUse
from swarmctl.suggest import did_you_mean, guess
from swarmctl.yamltext.edits import make_fix, rename_key
from swarmctl.yamltext.source import Loc


@rule("PKG004", "PKG005", "PKG006", "PKG007", ros1=True)
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
    loc: Loc = (*use.loc, key, fault.subject)
    return Diagnostic(
        "PKG005",
        f"the launch file of {use.owner} has no argument `{fault.subject}` ({fault.place})",
        context.launch_span(use, key, fault.subject, is_key=True),
        label="roslaunch stops: unused args",
        help=did_you_mean(fault.subject, fault.known, "it declares") or ("it declares no arguments",),
        fix=make_fix(f"write `{near}`", rename_key(context.source, loc, near), safe=meant.certain)
        if near and free
        else None,
    )
