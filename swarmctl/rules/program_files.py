"""The files that programs get, the bags that they record, and the paths that they name."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path

from swarmctl.diagnostics import Diagnostic, Fix, Span
from swarmctl.field_types import Parameter
from swarmctl.linter.context import RuleContext, rule
from swarmctl.ros_packages.launch_files import FIND
from swarmctl.ros_packages.parameters import ParameterFileError, read_file
from swarmctl.rules.parameters import reader_of
from swarmctl.spec.program_model import Program, Template
from swarmctl.swarm.program_values import TemplateError, rendered, template_values
from swarmctl.swarm.recordings import record_words
from swarmctl.swarm.resolve import resolve
from swarmctl.swarm.resolved import Swarm
from swarmctl.yamltext.edits import make_fix, rename_key, replace_value
from swarmctl.yamltext.source import Loc


@rule("PROG028")
def found(context: RuleContext) -> Iterator[Diagnostic]:
    """A file that does not lie beside the spec, or cannot be read."""
    refused = context.document.files.refused
    for name, program in context.spec.programs.items() if refused else ():
        for loc, path in _paths(program):
            if path in refused:
                yield Diagnostic(
                    "PROG028",
                    f"`{path}` {refused[path]}",
                    context.span("programs", name, *loc),
                    label=f"a file of program `{name}`",
                    help=("write its path from the folder of the spec",),
                )


def _paths(program: Program) -> Iterator[tuple[Loc, str]]:
    for name, source in program.files.items():
        if isinstance(source, Template):
            yield ("files", name, "template"), source.template
        else:
            yield ("files", name), source
    for name, path in program.file_params.items():
        yield ("params", name, "file"), path


@rule("PROG029", by_distro=True)
def parameters(context: RuleContext) -> Iterator[Diagnostic]:
    """A file of parameters that cannot be loaded."""
    reader = reader_of(context)
    for name, program in context.spec.programs.items():
        for key, path in program.file_params.items():
            content = context.document.files.content.get(path)
            try:
                if content is not None:
                    read_file(content, reader)
            except ParameterFileError as error:
                yield Diagnostic(
                    "PROG029",
                    f"{path}:{error.line}:{error.column} cannot be loaded as parameters: {error}",
                    context.span("programs", name, "params", key, "file"),
                    label=f"{reader} refuses it",
                    help=(error.help or "write `NAME: VALUE` on each line",),
                )


@rule("PROG030")
def templates(context: RuleContext) -> Iterator[Diagnostic]:
    """A template that cannot be rendered with the values of the spec."""
    used = [(name, one) for name, one in context.spec.programs.items() if _templates(one)]
    swarm = _swarm(context) if used else None
    for name, program in used if swarm is not None else ():
        for source in _templates(program):
            content = context.document.files.content.get(source.template)
            if content is None or swarm is None:
                continue
            values = template_values(swarm, swarm.programs[name])
            try:
                rendered(content, values)
            except TemplateError as error:
                file = str(Path(context.source.path).parent / source.template)
                yield Diagnostic(
                    "PROG030",
                    f"the template of program `{name}` cannot be rendered: {error}",
                    Span(file, error.line, error.column, error.line, error.column + 1),
                    label=f"with the values of host `{swarm.programs[name].host}`",
                    help=(f"it can use {', '.join(values)}", "`{% if NAME is defined %}` asks first"),
                )


def _templates(program: Program) -> list[Template]:
    return [one for one in program.files.values() if isinstance(one, Template)]


def _swarm(context: RuleContext) -> Swarm | None:
    """The resolved swarm; None where other rules have something to report first."""
    try:
        return resolve(context.document)
    except (ValueError, KeyError, StopIteration):
        return None


@rule("PROG031", needs="launched")
def arguments(context: RuleContext) -> Iterator[Diagnostic]:
    """An argument of a launch file, or a parameter of a shipped program, that is a list or a mapping."""
    for name, program in context.spec.programs.items():
        for key, value in program.params.items() if program.launch is not None else ():
            if not isinstance(value, (bool, int, float, str)):
                yield Diagnostic(
                    "PROG031",
                    f"`{key}` of program `{name}` is not an argument of a launch file: arguments are text",
                    context.span("programs", name, "params", key, key=True),
                    label="a list, a mapping or a file",
                    help=(
                        "put it into a file: files: {NAME.yaml: PATH}",
                        f"and give its place: args: {{{key}: '{{files}}/NAME.yaml'}}",
                    ),
                )


_NAMES = ("-O", "--output-name")


@rule("PROG033", needs="ros1-nodes")
def fixed_bags(context: RuleContext) -> Iterator[Diagnostic]:
    """A bag whose name is the same after a restart; a person who starts the program chooses when."""
    for name, program in context.spec.programs.items():
        key, words = record_words(program)
        at = next((at for at, word in enumerate(words) if _names_a_bag(word)), None)
        if at is None or program.lifecycle == "interactive":
            continue
        yield Diagnostic(
            "PROG033",
            f"each restart of program `{name}` overwrites its bag",
            context.span("programs", name, key, at),
            label="the bag always has this name",
            help=("write -o and a prefix: rosbag appends date, time and `.bag` to it",),
        )


def _names_a_bag(word: str) -> bool:
    return word in _NAMES or word.startswith(("--output-name=", "-O"))


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
_BUILTINS = frozenset({"source", ".", "cd", "export", "alias", "unset", "set", "ulimit", "umask"})
_OF_ROS_1 = frozenset({"rosrun", "roslaunch", "rosbag", "rostopic", "rosservice", "rosnode", "rosparam"})
_OPERATORS = frozenset({"&&", "||", "|", ";", "&", ">", ">>", "<", "2>", "2>&1", "&>"})
_QUOTED = '"FIRST && SECOND"'
_LAUNCH = (".launch", ".xml", ".test")
_SETUP = re.compile(r"(/devel|/install)?/(local_)?setup\.(ba|z|fi)?sh$")


@rule("PROG020", needs="catkin")
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


@rule("PROG021", needs="launched")
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
            if kind == "command" and (message := _for_a_shell(program, name, key, value)):
                yield Diagnostic(
                    "PROG021",
                    message,
                    context.span("programs", name, kind, key),
                    label="passed as it stands",
                    help=(f"for a shell write command: [bash, -c, {_QUOTED}]",)
                    if key or value in _BUILTINS
                    else (f"write each word on its own: [{', '.join(str(value).split())}]",),
                )
                continue
            finds = context.launches_executables or program.launch is not None
            found = _unexpanded(_without_find(value, kind) if finds else value, in_a_node=not evaluated)
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


def _for_a_shell(program: Program, name: str, index: str | int, word: Parameter) -> str | None:
    """Returns what is wrong with a word of a command that only a shell would read or divide."""
    if word in _OPERATORS:
        return f"no shell reads `{word}` in the command of program `{name}`"
    if index == 0 and word in _BUILTINS:
        return f"`{word}` is a command of shells, and no program that `{name}` could be"
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


@rule("PROG034", "PROG035", by_distro=True)
def first_words(context: RuleContext) -> Iterator[Diagnostic]:
    """A command of the other ROS, or one that asks for the rights of root."""
    ros_1, ros_2 = context.can("ros1-nodes"), context.can("domains")
    for name, program in context.spec.programs.items():
        first, second = (*(program.command or ()), "", "")[:2]
        if (ros_1 and first == "ros2") or (ros_2 and first in _OF_ROS_1):
            yield Diagnostic(
                "PROG034",
                f"`{first}` is a command of ROS {2 if ros_1 else 1}, not of `{next(iter(context.distros))}`",
                context.span("programs", name, "command", 0),
                label="probably not found",
                help=(
                    "start a node or a launch file by `package` and `executable` or `launch`"
                    if first in ("rosrun", "roslaunch") or second in ("run", "launch")
                    else f"use the command of {'ROS 1' if ros_1 else 'ROS 2'}",
                ),
            )
        elif first == "sudo" and program.lifecycle != "interactive" and _home(context, name) != "/root":
            yield Diagnostic(
                "PROG035",
                f"program `{name}` asks for the rights of root, which its unit cannot gain",
                context.span("programs", name, "command", 0),
                label="sudo stops with an error",
                help=(
                    "leave out `sudo`, and give the account what it needs: a group, or a rule of udev",
                    "or let a person start it: lifecycle: interactive",
                ),
            )


def _home(context: RuleContext, program: str) -> str:
    host = context.spec.hosts.get(context.program_hosts[program] or "")
    user = (host and host.user) or "robot"
    return "/root" if user == "root" else f"/home/{user}"


@rule("PROG022", needs="launch-xml")
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
                fix=make_fix(
                    "rename the key to `launch`",
                    rename_key(context.source, ("programs", name, "executable"), "launch"),
                    safe=False,
                )
                if program.launch is None
                else None,
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


@rule("PROG023")
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
    others = {"src", "build", "log", "logs"} | ({"devel"} if not context.has_masters else set())
    if (script is None and folder not in others) or not meant:
        return
    fix: Fix | None = make_fix(
        f"write `{meant}`", replace_value(context.source, loc, meant), safe=script is not None
    )
    yield Diagnostic(
        "PROG023",
        f"`{workspace}` is {'a file in a workspace' if script else 'a folder of a workspace'}",
        context.span(*loc),
        label=f"setup.bash is searched for below it, in {'devel and ' * context.has_masters}install",
        help=(f"write the workspace itself: {meant}",),
        fix=fix,
    )
