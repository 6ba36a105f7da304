"""Programs: what each starts and where, with which environment and parameters."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.field_types import NAMESPACE
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.ros_launchable import placeholders_in
from swarmctl.ros_packages.launch_files import FIND
from swarmctl.spec.program_model import Kind, Program
from swarmctl.suggest import did_you_mean, guess, suggestion
from swarmctl.swarm.program_values import available_to, texts_of
from swarmctl.swarm.shipped_programs import SHIPPED
from swarmctl.yamltext.edits import make_fix, remove, rename_key, replace_value, set_key

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
                context.span("programs", name, "host", "robot", "needs", key=True),
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
                    f"program `{name}` belongs to robot `{program.robot}`, but runs "
                    f"{'under another master' if context.has_masters else 'on another island'}",
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


@rule("PROG008", by_distro=True)
def environments(context: RuleContext) -> Iterator[Diagnostic]:
    """An environment variable that swarmctl sets for every host."""
    what = "which swarmctl writes for every host" if context.has_masters else "by which nodes find each other"
    for name, program in context.spec.programs.items():
        for key in program.environment:
            if key in context.middleware.variables:
                loc = ("programs", name, "environment", key)
                help_, fix = _instead(context, name, key)
                yield Diagnostic(
                    "PROG008",
                    f"program `{name}` sets `{key}`, {what}",
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
        origin = "the host's address and the mode" if context.has_masters else "`ros` and the mode"
        help_ = f"remove it; swarmctl derives it from {origin}"
        return help_, make_fix(f"remove `{key}`", remove(context.source, (*loc, key)), safe=False)
    if len(program.environment) == 1:
        edits = rename_key(context.source, loc, "namespace"), replace_value(context.source, loc, namespace)
    else:
        kind = next(one for one in ("package", "command", "container", "use") if getattr(program, one))
        added = set_key(context.source, ("programs", name), "namespace", namespace, after=kind)
        edits = remove(context.source, (*loc, key)), added
    title = f"write `namespace: {namespace}` instead"
    return "the key `namespace` of a program sets it", make_fix(title, *edits, safe=True)


@rule("PROG009", "PROG010", needs="ros1-nodes")
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


@rule("PROG016", needs="launched")
def substitutions(context: RuleContext) -> Iterator[Diagnostic]:
    """`$(...)` in a value that a launch file evaluates; it cannot be escaped. `$(find PACKAGE)` is meant."""
    for name, program in context.spec.programs.items():
        if program.package is None or not (program.launch or context.launches_executables):
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
                    f"{context.middleware.launcher} would evaluate the `$(` in `{where}` of program `{name}`",
                    context.span("programs", name, kind, key),
                    label="cannot be escaped",
                    help=("write the resulting value", "or set it in the launch file of your package"),
                )


_WORDS = {
    "use": "a program that swarmctl ships", "launch": "a launch file", "executable": "an executable",
    "command": "a command", "container": "a container",
}  # fmt: skip
# Placeholders that only some programs have, and what the others lack.
_LACKING = {
    "master_uri": "no ROS master",
    "robot": "no robot",
    "files": "no `files`",
    "secrets": "no `files` among its `secrets`",
}
_IN_COMMAND = "write it as a word of the command"
_NO_ARGUMENTS = "remove it: only launch files have arguments"
# What stands before a parameter or a new name on a command line.
_ROS_1, _ROS_2 = {"param": "_", "remap": ""}, {"param": "--ros-args -p ", "remap": "--ros-args -r "}
# What a kind of program does not read, and what to write instead.
_UNREAD: Mapping[Kind, Mapping[str, str]] = {
    "use": {
        "args": "write its settings under `params`",
        "namespace_argument": _NO_ARGUMENTS,
        "files": "remove it: teleop programs read no files",
        "secrets": "remove it: teleop programs need none",
        "lifecycle": "remove it: teleop-key is started by a person, teleop-joy is a service",
    },
    "command": {
        "params": "write {param}NAME:=VALUE as a word of the command, if it is a node",
        "remap": "write {remap}OLD:=NEW as a word of the command, if it is a node",
        "args": _IN_COMMAND,
        "namespace_argument": _NO_ARGUMENTS,
    },
    "container": {
        "params": "write {param}NAME:=VALUE under `args`, if it runs a node",
        "remap": "write {remap}OLD:=NEW under `args`, if it runs a node",
    },
}


@rule("PROG002", "PROG003", "PROG004")
def commands(context: RuleContext) -> Iterator[Diagnostic]:
    """A program that is not exactly one thing."""
    recorder = "rosbag" if context.has_masters else "ros2, bag"
    for name, program in context.spec.programs.items():
        starts = _starts(program)
        if not starts:
            lone = next((key for key in ("executable", "launch") if getattr(program, key) is not None), None)
            yield Diagnostic(
                "PROG002",
                f"program `{name}` has nothing to run",
                context.span("programs", name, *_STARTS, *([lone] if lone else []), key=True),
                label="`package` missing" if lone else "needs `use`, `package`, `command` or `container`",
                help=(
                    "add the ROS package: package: joy, executable: joy_node",
                    f"or any command: command: [{recorder}, record, -a]",
                    f"or a program that swarmctl ships: {_use_help()}",
                ),
            )
        elif len(starts) > 1:
            first, second = starts[:2]
            yield Diagnostic(
                "PROG003",
                f"program `{name}` has both `{first}` and `{second}`",
                context.span("programs", name, second, key=True),
                label="second program",
                notes=(Note(context.span("programs", name, first, key=True), "first program"),),
                help=("keep one, and add the other as a separate program",),
            )
        elif program.package is not None and (program.launch is None) == (program.executable is None):
            yield _start(context, name, program)


_STARTS = ("use", "package", "command", "container")


def _starts(program: Program) -> tuple[str, ...]:
    """The keys that each say what to start; `executable` and `launch` say it with `package`."""
    of_package = "package" if program.package is not None else None
    others = (program.use, program.command, program.container)
    if of_package is None and any(one is not None for one in others):
        of_package = next((key for key in ("executable", "launch") if getattr(program, key)), None)
    found = ("use" if program.use is not None else None, of_package, *(
        key for key in ("command", "container") if getattr(program, key) is not None
    ))  # fmt: skip
    return tuple(one for one in found if one is not None)


def _start(context: RuleContext, name: str, program: Program) -> Diagnostic:
    if program.launch is not None:
        return Diagnostic(
            "PROG004",
            f"program `{name}` has both an `executable` and a `launch` file",
            context.span("programs", name, "launch", key=True),
            label="only one of them is allowed",
            notes=(Note(context.span("programs", name, "executable", key=True), "the other one"),),
            help=("keep one; a launch file starts its own nodes",),
        )
    return Diagnostic(
        "PROG004",
        f"program `{name}` has neither an `executable` nor a `launch` file of `{program.package}`",
        context.span("programs", name, "executable", "launch", "package"),
        label="`executable` or `launch` missing",
        help=("add `executable: NODE`, or `launch: FILE.launch`",),
    )


def _use_help() -> str:
    return ", ".join(f"use: {one}" for one in SHIPPED)


@rule("PROG025", needs="launched")
def arguments(context: RuleContext) -> Iterator[Diagnostic]:
    """`args` that do not fit what is started, or that repeat `params`."""
    for name, program in context.spec.programs.items():
        for error in program.argument_errors() if program.use is None and program.command is None else ():
            message, _, help_text = str(error).partition("; ")
            loc = ("programs", name, *error.at)
            meant = isinstance(program.args, dict) and program.executable is not None and not program.params
            yield Diagnostic(
                "PROG025",
                f"program `{name}`: {message}",
                context.span(*loc, key=True),
                label="does not fit",
                help=(help_text,),
                fix=make_fix(
                    "rename the key to `params`", rename_key(context.source, loc, "params"), safe=False
                )
                if meant
                else None,
            )


@rule("PROG026", needs="launched")
def unread_keys(context: RuleContext) -> Iterator[Diagnostic]:
    """A key that this kind of program does not read."""
    words = _ROS_1 if "ros1-nodes" in context.middleware.capabilities else _ROS_2
    for name, program in context.spec.programs.items():
        kind = next(iter(program.kinds), None)
        for key, instead in _UNREAD.get(kind, {}).items() if kind is not None else ():
            if not _is_default(program, key):
                yield Diagnostic(
                    "PROG026",
                    f"program `{name}` is {_WORDS[kind or '']}, which has no `{key}`",
                    context.span("programs", name, key, key=True),
                    label="has no effect",
                    help=(instead.format(**words),),
                )


def _is_default(program: Program, key: str) -> bool:
    value: Any = getattr(program, key)
    return key not in program.model_fields_set or not value


@rule("PROG032")
def secrets(context: RuleContext) -> Iterator[Diagnostic]:
    """Secrets of a program that a person starts, or a variable that has both a secret and a plain value."""
    for name, program in context.spec.programs.items():
        if program.lifecycle == "interactive" and program.secrets.names:
            yield Diagnostic(
                "PROG032",
                f"program `{name}` is started by a person, who cannot read the secrets of the host",
                context.span("programs", name, "secrets", key=True),
                label="for root alone",
                help=("remove it, and let the person give the secret",),
            )
        for key in program.secrets.env:
            if key in program.environment:
                yield Diagnostic(
                    "PROG032",
                    f"`{key}` of program `{name}` is a secret and has a value in the spec, too",
                    context.span("programs", name, "secrets", "env", key, key=True),
                    label="the value of the spec would win",
                    notes=(Note(context.span("programs", name, "environment", key, key=True), "the value"),),
                    help=("remove it from `environment`",),
                )


@rule("PROG027", needs="launched")
def placeholders(context: RuleContext) -> Iterator[Diagnostic]:
    """A placeholder that has no value."""
    for name, program in context.spec.programs.items():
        known = [one for one in available_to(program) if one != "master_uri" or context.has_masters]
        for loc, text in texts_of(program):
            unknown = next((one for one in placeholders_in(text) if one not in known), None)
            if unknown is not None:
                meant = guess(unknown, known)
                spelt = text.replace(f"{{{unknown}}}", f"{{{meant.only}}}")
                edits = replace_value(context.source, ("programs", name, *loc), spelt) if meant.only else ()
                yield Diagnostic(
                    "PROG027",
                    f"program `{name}` has {_LACKING[unknown]} to fill in for `{{{unknown}}}`"
                    if unknown in _LACKING
                    else f"`{{{unknown}}}` in program `{name}` is not a placeholder",
                    context.span("programs", name, *loc),
                    label="has no value",
                    help=(
                        *suggestion(meant, known, "the placeholders are"),
                        "or write {{ and }} for braces of your own",
                    ),
                    fix=make_fix(f"write `{{{meant.only}}}`", edits, safe=False),
                )
