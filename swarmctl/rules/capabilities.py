"""The capabilities that programs need: some host has them, and the program's host does."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.spec.program_model import Program
from swarmctl.suggest import did_you_mean, nearest
from swarmctl.yamltext.edits import make_fix, replace_value


@rule("PROG014", "PROG015")
def needs(context: RuleContext) -> Iterator[Diagnostic]:
    """A capability that no host has, or that the program's host lacks."""
    owners: dict[str, list[str]] = {}
    for host, given in context.spec.hosts.items():
        for one in given.has:
            owners.setdefault(one, []).append(host)
    for name, program in context.spec.programs.items():
        unknown = next((one for one in program.needs if one not in owners), None)
        if unknown is not None:
            yield _nowhere(context, name, program, unknown, owners)
        elif program.host is None and program.robot is None:
            if program.needs and next(context.able_hosts(program.needs), None) is None:
                yield _nowhere_together(context, name, program, owners)
        else:
            yield from _elsewhere(context, name, program, owners)


def _nowhere(
    context: RuleContext, name: str, program: Program, need: str, owners: dict[str, list[str]]
) -> Diagnostic:
    near = nearest(need, owners)
    loc = ("programs", name, "needs", program.needs.index(need))
    return Diagnostic(
        "PROG014",
        f"program `{name}` needs `{need}`, which no host has",
        context.span(*loc),
        label="no host has this",
        help=(
            *(did_you_mean(need, tuple(owners), "the hosts have") if owners else ()),
            f"add it to the host that has it: has: [{need}]",
        ),
        fix=make_fix(f"write `{near}`", replace_value(context.source, loc, near), safe=False)
        if near
        else None,
    )


def _nowhere_together(
    context: RuleContext, name: str, program: Program, owners: dict[str, list[str]]
) -> Diagnostic:
    having = "; ".join(f"`{need}`: {', '.join(owners[need][:3])}" for need in program.needs)
    return Diagnostic(
        "PROG014",
        f"program `{name}` needs {_listed(program.needs)}, and no host that runs ROS has all of them",
        context.span("programs", name, "needs"),
        label="no suitable host",
        help=(f"hosts with each: {having}", "split it into two programs, or set its `host`"),
    )


def _elsewhere(
    context: RuleContext, name: str, program: Program, owners: dict[str, list[str]]
) -> Iterator[Diagnostic]:
    host = context.program_hosts[name]
    if host not in context.spec.hosts:
        return
    lacks = [need for need in program.needs if host not in owners[need]]
    if lacks:
        key = "host" if program.host is not None else "robot"
        yield Diagnostic(
            "PROG015",
            f"program `{name}` needs {_listed(lacks)}, which host `{host}` does not have",
            context.span("programs", name, key),
            label=f"runs on `{host}`",
            notes=(Note(context.span("programs", name, "needs"), "the program's needs"),),
            help=(
                f"{_listed(owners[lacks[0]][:3])} has `{lacks[0]}`: use it as the `host`",
                f"or add it to the `has` of `{host}`",
            ),
        )


def _listed(words: tuple[str, ...] | list[str]) -> str:
    return " and ".join(f"`{word}`" for word in words)
