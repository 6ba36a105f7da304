"""Paths and texts of programs: what ROS finds by them, and what nothing expands."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Fix
from swarmctl.field_types import Parameter
from swarmctl.ros_packages.substitution import FIND
from swarmctl.rules.context import RuleContext, rule
from swarmctl.spec.program_model import Program
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc

# Where ROS is found, set by its setup.bash; by variable, the folder without which it is not.
_SEARCH_PATHS = {
    "PYTHONPATH": "/opt/ros",
    "LD_LIBRARY_PATH": "/opt/ros",
    "ROS_PACKAGE_PATH": "/opt/ros",
    "CMAKE_PREFIX_PATH": "/opt/ros",
    "PATH": "/usr/bin",
}
_VARIABLE = re.compile(r"\$\{?[A-Za-z_][A-Za-z0-9_]*\}?", re.ASCII)
_HOME = re.compile(r"(?:^|(?<=:))~(?=/|$)")
_SUBSTITUTION = re.compile(r"\$\([a-z]+[^)]*\)?")
_EXPANDED_BY_ROS = "ROSCONSOLE_FORMAT"  # rosconsole replaces ${severity}, ${message} and the like
_COMMAND = re.compile(r"`[^`]+`")

_SHELLS = frozenset({"bash", "dash", "sh", "zsh"})
_OPERATORS = frozenset({"&&", "||", "|", ";", "&", ">", ">>", "<", "2>", "2>&1", "&>"})
_QUOTED = '"FIRST && SECOND"'
_LAUNCH = (".launch", ".xml", ".test")
_SETUP = re.compile(r"(/devel|/install)?/(local_)?setup\.(ba|z|fi)?sh$")


@rule("PROG020", ros1=True)
def search_paths(context: RuleContext) -> Iterator[Diagnostic]:
    """A search path that loses what ROS put there."""
    for name, program in context.spec.programs.items():
        for key, value in program.environment.items():
            needed = _lost(key, value)
            if needed is None:
                continue
            yield Diagnostic(
                "PROG020",
                f"program `{name}` replaces `{key}`, by which ROS is found",
                context.span("programs", name, "environment", key),
                label=f"without {needed}",
                help=(
                    "leave it out: `ros.workspace` adds a workspace to the search paths of every program",
                    f"or write the whole path, with the folders below {needed} that `env` shows on the host",
                ),
            )


def _lost(key: str, value: str) -> str | None:
    """Returns the folder of ROS that a search path loses."""
    needed = _SEARCH_PATHS.get(key)
    kept = needed is None or any(f"{part}/".startswith(f"{needed}/") for part in value.split(":"))
    return None if kept else needed


@rule("PROG021", ros1=True)
def unexpanded_texts(context: RuleContext) -> Iterator[Diagnostic]:
    """A variable, a home folder or a command in a value that no shell and no roslaunch expands."""
    for name, program in context.spec.programs.items():
        values: list[tuple[str, str | int, Parameter]] = [
            ("environment", key, value)
            for key, value in program.environment.items()
            if _lost(key, value) is None and key != _EXPANDED_BY_ROS
        ]
        if program.package is not None:
            stated, named = program.named_values
            values += [(stated, key, value) for key, value in named.items()]
        values += [("command", index, word) for index, word in enumerate(_words(program))]
        for kind, key, value in values:
            evaluated = kind == "environment" or (kind != "command" and program.launch is not None)
            if kind == "command" and (message := _for_a_shell(program, name, value)):
                yield Diagnostic(
                    "PROG021",
                    message,
                    context.span("programs", name, kind, key),
                    label="passed as it stands",
                    help=(f"for a shell write command: [bash, -c, {_QUOTED}]",)
                    if value in _OPERATORS
                    else (f"write each word on its own: [{', '.join(str(value).split())}]",),
                )
                continue
            found = _unexpanded(_without_find(value, kind), in_a_node=not evaluated)
            if found is None:
                continue
            home = _home(context, name)
            yield Diagnostic(
                "PROG021",
                f"nothing expands `{found}` in `{kind if isinstance(key, int) else key}` of program `{name}`",
                context.span("programs", name, kind, key),
                label="passed as it stands",
                help=(
                    f"write the folder itself: {home}"
                    if found in ("~", "$HOME", "${HOME}")
                    else "write the resulting value"
                    if not found.startswith("$(")
                    else "write the resulting path, or set it in a launch file of your package",
                ),
            )


def _for_a_shell(program: Program, name: str, word: Parameter) -> str | None:
    """Returns what is wrong with a word of a command that only a shell would read or divide."""
    if word in _OPERATORS:
        return f"no shell reads `{word}` in the command of program `{name}`"
    lone = program.command is not None and len(program.command) == 1
    if lone and isinstance(word, str) and len(word.split()) > 1 and not word.startswith("/"):
        return f"the command of program `{name}` is one word with blanks in it"
    return None


def _unexpanded(value: Parameter, *, in_a_node: bool) -> str | None:
    """Returns what somebody expects to be expanded; ``$(`` elsewhere is PROG016's; no file's text."""
    if not isinstance(value, str) or "\n" in value:
        return None
    patterns = (_VARIABLE, _HOME, _COMMAND, *((_SUBSTITUTION,) if in_a_node else ()))
    found = next((match for pattern in patterns if (match := pattern.search(value))), None)
    return found[0] if found else None


def _without_find(value: Parameter, kind: str) -> Parameter:
    """Returns a text without the folders that roslaunch finds; no shell does that in a command."""
    return FIND.sub("", value) if isinstance(value, str) and kind != "command" else value


def _words(program: Program) -> tuple[str, ...]:
    """The words of a command that no shell expands."""
    words = program.command or ()
    return () if words and posixpath.basename(words[0]) in _SHELLS else words


def _home(context: RuleContext, program: str) -> str:
    host = context.spec.hosts.get(context.program_hosts[program] or "")
    user = (host and host.user) or "robot"
    return "/root" if user == "root" else f"/home/{user}"


@rule("PROG022", ros1=True)
def launch_files(context: RuleContext) -> Iterator[Diagnostic]:
    """A `launch` that names no launch file of ROS 1, or an `executable` that is one."""
    for name, program in context.spec.programs.items():
        if program.executable is not None and program.executable.endswith((".launch", ".launch.xml")):
            yield Diagnostic(
                "PROG022",
                f"`{program.executable}` is a launch file, not an executable",
                context.span("programs", name, "executable"),
                label="the executable of program `" + name + "`",
                help=(f"write `launch: {program.executable}`",),
            )
        launch, loc = program.launch, ("programs", name, "launch")
        if launch is None:
            continue
        if launch.startswith("launch/"):
            yield Diagnostic(
                "PROG022",
                f"`{launch}` is searched for in the folder `launch` of the package",
                context.span(*loc),
                label=f"would be launch/{launch}",
                help=(f"write `{launch[7:]}`",),
                fix=make_fix(
                    f"write `{launch[7:]}`", replace_value(context.source, loc, launch[7:]), safe=True
                ),
            )
        elif not launch.endswith(_LAUNCH):
            yield Diagnostic(
                "PROG022",
                f"roslaunch does not read `{launch}`",
                context.span(*loc),
                label=f"no {', '.join(_LAUNCH[:2])} file",
                help=(
                    "ROS 1 has launch files in XML only; name one of the package's XML files"
                    if ".launch." in launch
                    else f"ROS 1 has launch files in XML only; a program is started by `executable: {launch}`"
                    if launch.endswith((".py", ".sh"))
                    else f"write the whole name of the file, such as `{launch}.launch`",
                ),
            )


@rule("PROG023", ros1=True)
def workspaces(context: RuleContext) -> Iterator[Diagnostic]:
    """A workspace that is a file or a folder within one."""
    if context.spec.ros.workspace is not None:
        yield from _within(context, context.spec.ros.workspace, ("ros", "workspace"))
    for name, host in context.spec.hosts.items():
        for number, workspace in enumerate(host.workspaces):
            yield from _within(context, workspace, ("hosts", name, "workspaces", number))


def _within(context: RuleContext, workspace: str, loc: Loc) -> Iterator[Diagnostic]:
    script, folder = _SETUP.search(workspace), workspace.rpartition("/")[2]
    meant = workspace[: script.start()] if script else workspace.rpartition("/")[0]
    if (script is None and folder not in ("src", "build", "logs")) or not meant:
        return
    fix: Fix | None = make_fix(
        f"write `{meant}`", replace_value(context.source, loc, meant), safe=script is not None
    )
    yield Diagnostic(
        "PROG023",
        f"`{workspace}` is {'a file in a workspace' if script else 'a folder of a workspace'}",
        context.span(*loc),
        label="setup.bash is searched for below it, in devel and install",
        help=(f"write the workspace itself: {meant}",),
        fix=fix,
    )
