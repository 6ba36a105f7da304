"""What programs need of their hosts: some host has it, and the one that they run on does."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.edits import mend, replace_value
from swarmctl.spec.model import Program
from swarmctl.spec.suggest import did_you_mean, nearest
from swarmctl.topology.interfaces import able_hosts, program_host


def needs(case: Case) -> Iterator[Diagnostic]:
    """PROG014, PROG015: what a program needs is somewhere, and where it is to run."""
    owners: dict[str, list[str]] = {}
    for host, given in case.spec.hosts.items():
        for one in given.has:
            owners.setdefault(one, []).append(host)
    for name, program in case.spec.programs.items():
        unknown = next((one for one in program.needs if one not in owners), None)
        if unknown is not None:
            yield _nowhere(case, name, program, unknown, owners)
        elif program.host is None and program.robot is None:
            if program.needs and next(able_hosts(case.spec, program.needs), None) is None:
                yield _nowhere_together(case, name, program, owners)
        else:
            yield from _elsewhere(case, name, program, owners)


def _nowhere(case: Case, name: str, program: Program, need: str, owners: dict[str, list[str]]) -> Diagnostic:
    near = nearest(need, tuple(owners))
    loc = ("programs", name, "needs", program.needs.index(need))
    return Diagnostic(
        "PROG014",
        f"program `{name}` needs `{need}`, which no host has",
        case.span(*loc),
        label="no host `has` this",
        help=(
            *(did_you_mean(need, tuple(owners), "hosts have") if owners else ()),
            f"say which host has it: hosts: ...: {{has: [{need}]}}",
        ),
        fix=mend(f"write `{near}`", replace_value(case.source, loc, near)) if near else None,
    )


def _nowhere_together(case: Case, name: str, program: Program, owners: dict[str, list[str]]) -> Diagnostic:
    told = "; ".join(f"`{need}`: {', '.join(owners[need][:3])}" for need in program.needs)
    return Diagnostic(
        "PROG014",
        f"program `{name}` needs {_listed(program.needs)}, and no host that runs ROS has all of it",
        case.span("programs", name, "needs"),
        label="runs nowhere",
        help=(f"who has what: {told}", "make two programs of it, or give it a `host`"),
    )


def _elsewhere(case: Case, name: str, program: Program, owners: dict[str, list[str]]) -> Iterator[Diagnostic]:
    host = program_host(case.spec, program)
    if host not in case.spec.hosts:
        return
    lacks = [need for need in program.needs if host not in owners[need]]
    if lacks:
        key = "host" if program.host is not None else "robot"
        yield Diagnostic(
            "PROG015",
            f"program `{name}` needs {_listed(lacks)}, which host `{host}` does not have",
            case.span("programs", name, key),
            severity=Severity.WARNING,
            label=f"runs on `{host}`",
            notes=(Note(case.span("programs", name, "needs"), "what it needs"),),
            help=(
                f"{_listed(owners[lacks[0]][:3])} has `{lacks[0]}`: name it as the `host`",
                f"or say that `{host}` has it, too",
            ),
        )


def _listed(words: tuple[str, ...] | list[str]) -> str:
    return " and ".join(f"`{word}`" for word in words)


RULES: tuple[Rule, ...] = (needs,)
