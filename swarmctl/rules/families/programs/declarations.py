"""Where each program runs, and with which environment and parameters."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.field_types import NAMESPACE
from swarmctl.ros_packages.substitution import FIND
from swarmctl.rules.context import RuleContext, rule
from swarmctl.suggest import did_you_mean, guess
from swarmctl.swarm.shipped_programs import SHIPPED
from swarmctl.yamltext.edits import make_fix, remove, rename_key, replace_value, set_key

# Set by swarmctl for each host, from its address and the mode.
IDENTITY = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE")
_GLOBAL = "use_sim_time"  # nodes read only the global /use_sim_time
_PARAMETER = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*", re.ASCII)


@rule("PROG005")
def shipped_programs(context: RuleContext) -> Iterator[Diagnostic]:
    """`use` names a program that swarmctl ships."""
    for name, program in context.spec.programs.items():
        if program.use is None or program.use in SHIPPED:
            continue
        meant = guess(program.use, SHIPPED)
        near = meant.only
        loc = ("programs", name, "use")
        yield Diagnostic(
            "PROG005",
            f"swarmctl ships no program `{program.use}`",
            context.span(*loc),
            label="unknown program",
            help=(
                *did_you_mean(program.use, SHIPPED, "swarmctl ships"),
                "for a program of a ROS package, write package: ..., executable: ...",
            ),
            fix=make_fix(f"write `{near}`", replace_value(context.source, loc, near), safe=meant.certain)
            if near
            else None,
        )


@rule("PROG006", "PROG007")
def where_they_run(context: RuleContext) -> Iterator[Diagnostic]:
    """A program without a host, or under another master than its robot's driver."""
    for name, program in context.spec.programs.items():
        if program.host is None and program.robot is None and not program.needs:
            yield Diagnostic(
                "PROG006",
                f"program `{name}` has no host",
                context.span("programs", name, key=True),
                label="`host`, `robot` or `needs` missing",
                help=(
                    "add `host: ...` to run it on that host",
                    "or `robot: ...` to run it on that robot's host, in its namespace",
                    "or `needs: [...]` to run it on the first host that has these capabilities",
                ),
            )
        elif program.host is not None and program.robot is not None:
            home, driving = context.home.get(program.host), context.driving[program.robot]
            theirs = context.home.get(driving or "")
            if home is not None and theirs is not None and home.name != theirs.name:
                yield Diagnostic(
                    "PROG007",
                    f"program `{name}` belongs to robot `{program.robot}`, but runs under another master",
                    context.span("programs", name, "host"),
                    label=f"on island `{home.name}`",
                    notes=(
                        Note(
                            context.span("programs", name, "robot"),
                            f"driven by `{driving}` on island `{theirs.name}`",
                        ),
                    ),
                    help=(
                        f"remove `host` to run it on `{driving}`",
                        "or remove `robot` and use absolute topic names",
                    ),
                )


@rule("PROG008", ros1=True)
def environments(context: RuleContext) -> Iterator[Diagnostic]:
    """An environment variable that swarmctl sets for every host."""
    for name, program in context.spec.programs.items():
        for key in program.environment:
            if key in IDENTITY:
                loc = ("programs", name, "environment", key)
                help_, fix = _instead(context, name, key)
                yield Diagnostic(
                    "PROG008",
                    f"program `{name}` sets `{key}`, which swarmctl writes for every host",
                    context.span(*loc, key=True),
                    label="would override it",
                    help=(help_,),
                    fix=fix,
                )


def _instead(context: RuleContext, name: str, key: str) -> tuple[str, Fix | None]:
    """What replaces the variable ``key`` of a program: for its namespace the key of that name."""
    program, loc = context.spec.programs[name], ("programs", name, "environment")
    namespace = program.environment[key].strip("/")
    if key != "ROS_NAMESPACE" or program.namespace is not None or not re.fullmatch(NAMESPACE, namespace):
        help_ = "remove it; swarmctl derives it from the host's address and the mode"
        return help_, make_fix(f"remove `{key}`", remove(context.source, (*loc, key)), safe=False)
    if len(program.environment) == 1:
        edits = rename_key(context.source, loc, "namespace"), replace_value(context.source, loc, namespace)
    else:
        kind = next(one for one in ("package", "command", "container", "use") if getattr(program, one))
        added = set_key(context.source, ("programs", name), "namespace", namespace, after=kind)
        edits = remove(context.source, (*loc, key)), added
    title = f"write `namespace: {namespace}` instead"
    return "the key `namespace` of a program sets it", make_fix(title, *edits, safe=True)


@rule("PROG009", "PROG010", ros1=True)
def parameters(context: RuleContext) -> Iterator[Diagnostic]:
    """A private `use_sim_time`, or an invalid parameter name."""
    for name, program in context.spec.programs.items():
        for key in program.params:
            loc = ("programs", name, "params", key)
            if key == _GLOBAL:
                yield Diagnostic(
                    "PROG009",
                    f"`{key}` as a private parameter of program `{name}` has no effect",
                    context.span(*loc, key=True),
                    label="global for a ROS graph",
                    help=(
                        "set /use_sim_time in a launch file, on every master whose nodes use simulated time",
                    ),
                    fix=make_fix(f"remove `{key}`", remove(context.source, loc), safe=False),
                )
            elif not _PARAMETER.fullmatch(key):
                yield Diagnostic(
                    "PROG010",
                    f"`{key}` is not a valid parameter name",
                    context.span(*loc, key=True),
                    label="letters, digits and underscores, starting with a letter",
                    help=("write the name as the node reads it, without `~`",),
                    fix=make_fix(
                        f"write `{key[1:]}`", rename_key(context.source, loc, key[1:]), safe=key[0] == "~"
                    )
                    if _PARAMETER.fullmatch(key[1:]) and key[1:] not in program.params
                    else None,
                )


@rule("PROG016", ros1=True)
def substitutions(context: RuleContext) -> Iterator[Diagnostic]:
    """`$(...)` in a value that roslaunch evaluates; it cannot be escaped. `$(find PACKAGE)` is meant."""
    for name, program in context.spec.programs.items():
        if program.package is None:
            continue
        values: list[tuple[str, str | int, str]] = [
            ("environment", key, value) for key, value in program.environment.items()
        ]
        if program.launch is not None:
            stated, arguments = program.named_values
            values += [(stated, key, str(value)) for key, value in arguments.items()]
        values += [("args", index, word) for index, word in enumerate(program.words)]
        for kind, key, value in values:
            if "$(" in FIND.sub("", value):
                where = value if isinstance(key, int) else key
                yield Diagnostic(
                    "PROG016",
                    f"roslaunch would evaluate the `$(` in `{where}` of program `{name}`",
                    context.span("programs", name, kind, key),
                    label="cannot be escaped",
                    help=("write the resulting value", "or set it in the launch file of your package"),
                )
