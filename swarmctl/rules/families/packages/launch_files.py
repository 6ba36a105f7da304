"""roslaunch accepts the launch files of programs, with the arguments that the spec gives."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.ros_packages.launched import Fault, Refusal
from swarmctl.rules.context import RuleContext, rule
from swarmctl.suggest import did_you_mean, guess
from swarmctl.yamltext.edits import make_fix, rename_key
from swarmctl.yamltext.source import Loc


@rule("PKG004", "PKG005", "PKG006", "PKG007", ros1=True)
def accepted(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file that roslaunch refuses, or a part of which it skips."""
    for name, launched in context.launches.items():
        seen: set[tuple[Refusal, str]] = set()
        for fault in launched.faults:
            if (fault.kind, fault.subject) not in seen:
                seen.add((fault.kind, fault.subject))
                yield _finding(context, name, fault)


def _finding(context: RuleContext, name: str, fault: Fault) -> Diagnostic:
    given = context.spec.programs[name].params
    param = fault.subject if fault.subject in given else None
    loc: Loc = ("programs", name, "launch")
    if fault.kind is Refusal.UNUSED and not fault.place.line and param is not None:
        return _unused(context, ("programs", name, "params", param), name, fault)
    if fault.kind is Refusal.UNUSED:
        return Diagnostic(
            "PKG005",
            f"{fault.place} passes the argument `{fault.subject}`: {fault.text}",
            context.span(*loc),
            label="roslaunch stops: unused args",
            help=did_you_mean(fault.subject, fault.known, "it declares"),
        )
    if fault.kind is Refusal.FIXED and param is not None:
        return Diagnostic(
            "PKG005",
            f"`{param}` cannot be given to the launch file of program `{name}`: {fault.text} ({fault.place})",
            context.span("programs", name, "params", param, key=True),
            label="cannot override",
            help=("remove it here", "or write `default` instead of `value` in the launch file"),
        )
    if fault.kind is Refusal.MISSING:
        return Diagnostic(
            "PKG006",
            f"the launch file of program `{name}` needs the argument `{fault.subject}` ({fault.place})",
            context.span(*loc),
            label=f"`{fault.subject}` is not given",
            help=(
                f"write it under `params`: {{{fault.subject}: VALUE}}",
                "or give it a `default` in the launch file",
            ),
        )
    if fault.kind is Refusal.SKIPPED:
        return Diagnostic(
            "PKG007",
            f"{fault.text} ({fault.place})",
            context.span(*loc),
            label="a part of it is not started",
            help=did_you_mean(fault.subject, _ELEMENTS, "it knows"),
        )
    return Diagnostic(
        "PKG004",
        f"roslaunch cannot read {fault.place}: {fault.text}",
        context.span(*loc),
        label="program does not start",
        help=did_you_mean(fault.subject, fault.known, "files of that package")
        or ("`roslaunch --nodes PACKAGE FILE` shows its own message",),
    )


_ELEMENTS = ("arg", "env", "group", "include", "machine", "node", "param", "remap", "rosparam", "test")


def _unused(context: RuleContext, loc: Loc, name: str, fault: Fault) -> Diagnostic:
    meant = guess(fault.subject, fault.known)
    near = meant.only
    free = near is not None and near not in context.spec.programs[name].params
    return Diagnostic(
        "PKG005",
        f"the launch file of program `{name}` has no argument `{fault.subject}`",
        context.span(*loc, key=True),
        label="roslaunch stops: unused args",
        help=did_you_mean(fault.subject, fault.known, "it declares") or ("it declares no arguments",),
        fix=make_fix(f"write `{near}`", rename_key(context.source, loc, near), safe=meant.certain)
        if near and free
        else None,
    )
