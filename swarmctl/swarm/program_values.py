"""The values of a program's placeholders, such as `{host}`, and the texts that may have them. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from types import TracebackType
from typing import TYPE_CHECKING

from swarmctl.robot_types.ros_launchable import Loc, texts_in
from swarmctl.spec import program_model as declared_program
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Program, Swarm

if TYPE_CHECKING:
    import jinja2


#: Every placeholder with its meaning.
PLACEHOLDERS: Mapping[str, str] = {
    "swarm": "the swarm's name",
    "program": "the program's name",
    "host": "its host",
    "address": "the address of its host",
    "master_uri": "the URI of its ROS master; not with ROS 2, which has none",
    "namespace": "its ROS namespace, without the leading slash; empty if it has none",
    "robot": "its robot; only of a program with `robot`",
    "files": "the folder of its `files` on the host",
    "secrets": "the folder of its secret files on the host",
}


def available_to(program: declared_program.Program) -> tuple[str, ...]:
    """Returns the placeholders that a program has values for."""
    given = {"robot": program.robot, "files": program.files, "secrets": program.secrets.files}
    return tuple(name for name in PLACEHOLDERS if given.get(name, True))


def values_of(swarm: Swarm, program: Program) -> Mapping[str, str]:
    """Returns the value of each placeholder."""
    host = swarm.hosts[program.host]
    found = {
        "swarm": swarm.name,
        "program": program.name,
        "host": host.name,
        "address": host.ros_address,
        **_master(swarm, host),
        "namespace": program.namespace[1:],
        "files": files_folder(swarm.name, program.name),
        "secrets": secrets_folder(swarm.name, program.name),
    }
    robot = program.declared.robot
    return {**found, "robot": robot} if robot is not None else found


def _master(swarm: Swarm, host: Host) -> Mapping[str, str]:
    island = swarm.island_of(host.name)
    return {"master_uri": swarm.master_uri(island)} if island.has_master else {}


def template_values(swarm: Swarm, program: Program) -> Mapping[str, object]:
    """Returns what a template of the program may use: its placeholders, its node, all hosts and robots."""
    return {
        **values_of(swarm, program),
        "node": program.node,
        "hosts": {host.name: host.ros_address for host in swarm.hosts.values()},
        "robots": list(swarm.robots),
    }


def files_folder(swarm: str, program: str) -> str:
    """Returns the folder of a program's files on its host."""
    return f"/opt/swarm/{swarm}/current/files/{program}"


def texts_of(program: declared_program.Program) -> Iterator[tuple[Loc, str]]:
    """Yields every text that may have placeholders, with its place within the program.

    Parameters of the programs that swarmctl ships are their settings, and have none.
    """
    yield from texts_in(program.environment, "environment")
    if program.use is not None:
        return
    if program.package is not None and (program.launch is None or not program.args):
        own = {name: one for name, one in program.params.items() if name not in program.file_params}
        yield from texts_in(own, "params")
    yield from texts_in(program.command, "command")
    if program.container is not None:
        yield from texts_in(program.container.command, "container", "command")
    yield from texts_in(program.args, "args")


def secrets_folder(swarm: str, program: str) -> str:
    """Returns the folder of a program's secrets on its host: in memory, and gone when the program ends."""
    return f"/run/swarm-secrets/{names.runtime_folder(swarm, program)}"


_NAME = "template"
_MAX_CHARACTERS = 4 << 20
_QUOTED = re.compile(r"'([^']+)'")


class TemplateError(ValueError):
    """A template that cannot be rendered. ``line`` and ``column`` count from 1."""

    def __init__(self, message: str, line: int, column: int) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


def rendered(content: bytes, values: Mapping[str, object]) -> bytes:
    """Returns a template's text with ``values``; a value that is not defined is an error.

    Raises TemplateError.
    """
    from jinja2 import TemplateSyntaxError  # noqa: PLC0415  (most specs have no templates)

    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise TemplateError(f"the byte 0x{content[error.start]:02X} is not valid UTF-8", line, 1) from None
    try:
        template = _environment().from_string(text)
        return _limited(template, values).encode()
    except TemplateSyntaxError as error:
        message = error.message or "it is not a template"
        raise TemplateError(message, error.lineno, _column(text, error.lineno, message)) from None
    except TemplateError:
        raise
    except Exception as error:  # noqa: BLE001  (an expression of the user's may raise anything)
        line, message = _line(error.__traceback__), str(error) or type(error).__name__
        raise TemplateError(message, line, _column(text, line, message)) from None


def _limited(template: jinja2.Template, values: Mapping[str, object]) -> str:
    parts: list[str] = []
    size = 0
    for part in template.generate(values):
        size += len(part)
        if size > _MAX_CHARACTERS:
            raise TemplateError(f"it makes more than {_MAX_CHARACTERS >> 20} MiB", 1, 1)
        parts.append(part)
    return "".join(parts)


def _line(traceback: TracebackType | None) -> int:
    """The innermost line of the template; Jinja rewrites the traceback to have its lines."""
    line = 1
    while traceback is not None:
        if traceback.tb_frame.f_code.co_filename in (f"<{_NAME}>", "<unknown>"):
            line = traceback.tb_lineno
        traceback = traceback.tb_next
    return line


def _column(text: str, line: int, message: str) -> int:
    """Where the line has what the message names; else where its text begins."""
    lines = text.splitlines() or [""]
    written = lines[min(line, len(lines)) - 1]
    for word in _QUOTED.findall(message):
        if found := re.search(rf"\b{re.escape(word)}\b", written):
            return found.start() + 1
    return len(written) - len(written.lstrip()) + 1


@cache
def _environment() -> jinja2.Environment:
    from jinja2 import StrictUndefined  # noqa: PLC0415  (most specs have no templates)
    from jinja2.sandbox import ImmutableSandboxedEnvironment  # noqa: PLC0415

    return ImmutableSandboxedEnvironment(
        undefined=StrictUndefined, keep_trailing_newline=True, trim_blocks=True, lstrip_blocks=True
    )
