"""Every program says what it is and where it runs, in words that ROS understands."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.edits import mend, remove, rename_key, replace_value
from swarmctl.spec.model import Program
from swarmctl.spec.suggest import did_you_mean, nearest
from swarmctl.topology.programs import SHIPPED

# Who a node is and which master it follows; swarmctl writes them for each host, from its address.
_IDENTITY = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE")
_OF_THE_GRAPH = "use_sim_time"  # read from /use_sim_time only
_PARAMETER = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*", re.ASCII)


def what_they_are(case: Case) -> Iterator[Diagnostic]:
    """PROG002, PROG003, PROG004: a program is one that swarmctl ships, or one start of one ROS package."""
    for name, program in case.spec.programs.items():
        starts = [key for key in ("executable", "launch") if getattr(program, key) is not None]
        if program.use is None and program.package is None:
            yield Diagnostic(
                "PROG002",
                f"program `{name}` does not say what to run",
                case.span("programs", name, starts[0], key=True)
                if starts
                else case.span("programs", name, key=True),
                label="of which package?" if starts else "needs `use`, or `package`",
                help=(
                    "add the ROS package: package: joy, executable: joy_node",
                    f"or one that swarmctl ships: {_use_help()}",
                ),
            )
        elif program.use is not None and (program.package is not None or starts):
            key = "package" if program.package is not None else starts[0]
            yield Diagnostic(
                "PROG003",
                f"program `{name}` is two: `use` and `{key}`",
                case.span("programs", name, key, key=True),
                label="a second program",
                notes=(Note(case.span("programs", name, "use", key=True), "the first"),),
                help=("keep one; the other may be a program of its own",),
            )
        elif program.package is not None and len(starts) != 1:
            yield _start(case, name, program)


def _start(case: Case, name: str, program: Program) -> Diagnostic:
    if program.launch is not None:
        return Diagnostic(
            "PROG004",
            f"program `{name}` has both an `executable` and a `launch` file",
            case.span("programs", name, "launch", key=True),
            label="one of the two starts it",
            notes=(Note(case.span("programs", name, "executable", key=True), "the other"),),
            help=("keep one; a launch file starts its nodes itself",),
        )
    return Diagnostic(
        "PROG004",
        f"program `{name}` does not say what of `{program.package}` to run",
        case.span("programs", name, "package"),
        label="which node, or which launch file?",
        help=("add `executable: ...` (one node), or `launch: ....launch`",),
    )


def _use_help() -> str:
    return ", ".join(f"use: {one}" for one in SHIPPED)


def shipped_programs(case: Case) -> Iterator[Diagnostic]:
    """PROG005: `use` names a program that swarmctl ships."""
    for name, program in case.spec.programs.items():
        if program.use is None or program.use in SHIPPED:
            continue
        near = nearest(program.use, tuple(SHIPPED))
        loc = ("programs", name, "use")
        yield Diagnostic(
            "PROG005",
            f"swarmctl ships no program `{program.use}`",
            case.span(*loc),
            label="not among them",
            help=(
                *did_you_mean(program.use, SHIPPED, "it ships"),
                "a program of a ROS package is named so: package: ..., executable: ...",
            ),
            fix=mend(f"write `{near}`", replace_value(case.source, loc, near)) if near else None,
        )


def where_they_run(case: Case) -> Iterator[Diagnostic]:
    """PROG006, PROG007: a program has a host, and the one it shares a master with is its robot's."""
    for name, program in case.spec.programs.items():
        if program.host is None and program.robot is None and not program.needs:
            yield Diagnostic(
                "PROG006",
                f"program `{name}` runs nowhere",
                case.span("programs", name, key=True),
                label="on which host, or for which robot?",
                help=(
                    "add `host: ...`, the computer that it runs on",
                    "or `robot: ...`: on that robot's host, in its namespace",
                    "or `needs: [...]`: on the first host that `has` it",
                ),
            )
        elif program.host is not None and program.robot is not None:
            home, driving = case.home.get(program.host), case.driving[program.robot]
            theirs = case.home.get(driving or "")
            if home is not None and theirs is not None and home.name != theirs.name:
                yield Diagnostic(
                    "PROG007",
                    f"program `{name}` belongs to robot `{program.robot}`, but runs under another master",
                    case.span("programs", name, "host"),
                    severity=Severity.WARNING,
                    label=f"on island `{home.name}`",
                    notes=(
                        Note(
                            case.span("programs", name, "robot"),
                            f"driven by `{driving}` on island `{theirs.name}`",
                        ),
                    ),
                    help=(
                        f"remove `host` to let it run on `{driving}`",
                        "or remove `robot` and give the topics their full names",
                    ),
                )


def identities(case: Case) -> Iterator[Diagnostic]:
    """PROG008: a program's environment says nothing about who it is and which master it follows."""
    for name, program in case.spec.programs.items():
        for key in program.environment:
            if key in _IDENTITY:
                loc = ("programs", name, "environment", key)
                yield Diagnostic(
                    "PROG008",
                    f"program `{name}` sets `{key}`, which swarmctl writes for every host",
                    case.span(*loc, key=True),
                    label="would lead it to another graph",
                    help=("remove it; the address of the host and the mode say the same",),
                    fix=mend(f"remove `{key}`", remove(case.source, loc)),
                )


def parameters(case: Case) -> Iterator[Diagnostic]:
    """PROG009, PROG010: parameters are a program's own, under names that ROS takes."""
    for name, program in case.spec.programs.items():
        for key in program.params:
            loc = ("programs", name, "params", key)
            if key == _OF_THE_GRAPH:
                yield Diagnostic(
                    "PROG009",
                    f"`{key}` is a parameter of a whole ROS graph; as one of `{name}` nobody reads it",
                    case.span(*loc, key=True),
                    severity=Severity.WARNING,
                    label="has no effect here",
                    help=(
                        "set /use_sim_time in a launch file, on every master whose nodes live in that time",
                    ),
                    fix=mend(f"remove `{key}`", remove(case.source, loc)),
                )
            elif not _PARAMETER.fullmatch(key):
                yield Diagnostic(
                    "PROG010",
                    f"`{key}` is no name of a parameter",
                    case.span(*loc, key=True),
                    label="letters, digits and underscores, a letter first",
                    help=("write it as its node calls it, without the `~`",),
                    fix=mend(f"write `{key[1:]}`", rename_key(case.source, loc, key[1:]))
                    if _PARAMETER.fullmatch(key[1:]) and key[1:] not in program.params
                    else None,
                )


def substitutions(case: Case) -> Iterator[Diagnostic]:
    """PROG016: roslaunch would work out `$(...)` in what a launch file is told; nothing escapes it there."""
    for name, program in case.spec.programs.items():
        if program.package is None:
            continue
        told = [("environment", key, value) for key, value in program.environment.items()]
        if program.launch is not None:
            told += [("params", key, str(value)) for key, value in program.params.items()]
        for kind, key, value in told:
            if "$(" in value:
                yield Diagnostic(
                    "PROG016",
                    f"roslaunch would work out the `$(` in `{key}` of program `{name}`",
                    case.span("programs", name, kind, key),
                    label="cannot be written as it is",
                    help=("write what it comes to", "or set it in the launch file of your package"),
                )


RULES: tuple[Rule, ...] = (
    what_they_are,
    shipped_programs,
    where_they_run,
    identities,
    parameters,
    substitutions,
)
