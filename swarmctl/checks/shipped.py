"""The programs that swarmctl ships are told what they understand, and have somebody to command."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Severity
from swarmctl.spec.edits import mend, rename_key, replace_value
from swarmctl.spec.shipped import shipped
from swarmctl.spec.suggest import did_you_mean, nearest


def unknown_settings(case: Case) -> Iterator[Diagnostic]:
    """PROG011: a parameter that the shipped program does not have."""
    for name, program in case.spec.programs.items():
        known = shipped().get(program.use or "")
        for key in program.params if known is not None else ():
            if known is None or key in known:
                continue
            loc = ("programs", name, "params", key)
            near = nearest(key, tuple(known))
            yield Diagnostic(
                "PROG011",
                f"`{program.use}` has no setting `{key}`",
                case.span(*loc, key=True),
                label="would change nothing",
                help=did_you_mean(key, known, "it has"),
                fix=mend(f"write `{near}`", rename_key(case.source, loc, near))
                if near and near not in program.params
                else None,
            )


def unfit_settings(case: Case) -> Iterator[Diagnostic]:
    """PROG012: a setting of a shipped program with a value that it refuses."""
    for name, program in case.spec.programs.items():
        known = shipped().get(program.use or "", {})
        for key, value in program.params.items() if known else ():
            if key not in known or known[key].takes(value):
                continue
            loc, setting = ("programs", name, "params", key), known[key]
            bare = isinstance(value, str) and (number := _number(value)) is not None and setting.takes(number)
            yield Diagnostic(
                "PROG012",
                f"`{key}` of `{program.use}` is {setting.range}",
                case.span(*loc),
                label="a number in quotes is text" if bare else "refused",
                help=(f"`{key}`: {setting.meaning[0].lower()}{setting.meaning[1:]}",),
                fix=mend("remove the quotes", replace_value(case.source, loc, number)) if bare else None,
            )


def _number(text: str) -> int | float | None:
    with contextlib.suppress(ValueError):
        return int(text)
    with contextlib.suppress(ValueError):
        return float(text)
    return None


def idle_commanders(case: Case) -> Iterator[Diagnostic]:
    """PROG013: a joystick or keyboard that `control` gives no robot."""
    commanders = {control.by for control in case.spec.control} if case.spec.programs else set()
    for name, program in case.spec.programs.items():
        if program.use in shipped() and name not in commanders:
            yield Diagnostic(
                "PROG013",
                f"program `{name}` has no robot to command",
                case.span("programs", name, key=True),
                severity=Severity.WARNING,
                label="not in `control`",
                help=(f"add to `control`: {{by: {name}, of: [...]}}",),
            )


RULES: tuple[Rule, ...] = (unknown_settings, unfit_settings, idle_commanders)
