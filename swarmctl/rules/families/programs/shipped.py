"""The parameters of the programs that swarmctl ships, and the robots that they command."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.context import RuleContext, rule
from swarmctl.spec.program_params import shipped
from swarmctl.suggest import did_you_mean, guess
from swarmctl.yamltext.edits import make_fix, rename_key, replace_value


@rule("PROG011")
def unknown_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """An unknown parameter of a shipped program."""
    for name, program in context.spec.programs.items():
        known = shipped().get(program.use or "")
        for key in program.params if known is not None else ():
            if known is None or key in known:
                continue
            loc = ("programs", name, "params", key)
            meant = guess(key, known)
            near = meant.only
            yield Diagnostic(
                "PROG011",
                f"`{program.use}` has no parameter `{key}`",
                context.span(*loc, key=True),
                label="has no effect",
                help=did_you_mean(key, known, "its parameters are"),
                fix=make_fix(f"write `{near}`", rename_key(context.source, loc, near), safe=meant.certain)
                if near and near not in program.params
                else None,
            )


@rule("PROG012")
def invalid_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter of a shipped program with an invalid value."""
    for name, program in context.spec.programs.items():
        known = shipped().get(program.use or "", {})
        for key, value in program.params.items() if known else ():
            if key not in known or known[key].takes(value):
                continue
            loc, setting = ("programs", name, "params", key), known[key]
            bare = isinstance(value, str) and (number := _number(value)) is not None and setting.takes(number)
            yield Diagnostic(
                "PROG012",
                f"`{key}` of `{program.use}` must be {setting.range}",
                context.span(*loc),
                label="a number in quotes is text" if bare else "invalid value",
                help=(f"`{key}`: {setting.meaning[0].lower()}{setting.meaning[1:]}",),
                fix=make_fix("remove the quotes", replace_value(context.source, loc, number), safe=True)
                if bare
                else None,
            )


def _number(text: str) -> int | float | None:
    with contextlib.suppress(ValueError):
        return int(text)
    with contextlib.suppress(ValueError):
        return float(text)
    return None


@rule("PROG013")
def programs_without_robot(context: RuleContext) -> Iterator[Diagnostic]:
    """A joystick or keyboard program without a robot in `control`."""
    commanders = {control.by for control in context.spec.control} if context.spec.programs else set()
    for name, program in context.spec.programs.items():
        if program.use in shipped() and name not in commanders:
            yield Diagnostic(
                "PROG013",
                f"program `{name}` has no robot to command",
                context.span("programs", name, key=True),
                label="not in `control`",
                help=(f"add to `control`: {{by: {name}, of: [...]}}",),
            )
