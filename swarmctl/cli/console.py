"""Output: results on stdout, everything else on stderr, with colour or without."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import replace
from enum import Enum
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import typer

from swarmctl.cli import exit_codes

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.diagnostics import Diagnostic
    from swarmctl.spec.load import Document
    from swarmctl.swarm.resolved import Swarm
    from swarmctl.views.findings.report import Checked

WIDE = 240
_NARROWEST = 40  # a table in less has no text left; the terminal folds its lines


class Colour(str, Enum):
    """The values of ``--color``."""

    AUTO = "auto"
    ALWAYS = "always"
    NEVER = "never"


_colour = ContextVar("colour", default=Colour.AUTO)
_json = ContextVar("json", default=False)


def choose_colour(choice: Colour | None) -> None:
    """Set the colour mode of ``--color``; without it, the environment and the terminal decide."""
    if choice is not None:
        _colour.set(choice)


def choose_json(wanted: bool) -> bool:
    """Set whether findings that end a verb are one JSON document on stdout as well."""
    _json.set(wanted)
    return wanted


def out() -> Console:
    """The console of stdout, for results. Tables are not folded if stdout is not a terminal."""
    return _console(stderr=False, terminal=sys.stdout.isatty(), coloured=_coloured(sys.stdout))


def err() -> Console:
    """The console of stderr, for messages, warnings and progress."""
    return _console(stderr=True, terminal=sys.stderr.isatty(), coloured=_coloured(sys.stderr))


def _coloured(stream: TextIO) -> bool:
    """https://no-color.org and https://force-color.org: an empty variable counts as unset."""
    if (choice := _colour.get()) is not Colour.AUTO:
        return choice is Colour.ALWAYS
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (stream.isatty() and os.environ.get("TERM") != "dumb")


@cache
def _console(*, stderr: bool, terminal: bool, coloured: bool) -> Console:
    """One console per stream, so that text printed during a live display stays above it."""
    from rich.console import Console

    dumb = not terminal or os.environ.get("TERM") == "dumb"
    sizes = ("COLUMNS", "LINES")  # a size of 0 would hide all text
    environ = {key: value for key, value in os.environ.items() if key not in sizes or value.strip("0")}
    console = Console(
        stderr=stderr,
        force_terminal=terminal,
        color_system=None if not coloured else "standard" if dumb else "auto",
        no_color=False,
        width=None if stderr or terminal else WIDE,
        soft_wrap=True,
        highlight=False,
        markup=False,
        emoji=False,
        _environ=environ,
    )
    if console.width < _NARROWEST:  # noqa: PLR1730  a width that is set no longer follows the terminal
        console.width = _NARROWEST
    return console


def columns() -> int | None:
    """The columns of the terminal that results go to; None if they go to a file or a pipe."""
    return out().width if out().is_terminal else None


def show(text: Text | str, *, error: bool = False) -> None:
    """Print lines on stdout or stderr; those wider than the terminal go on below, 4 blanks further in."""
    from rich.text import Text

    from swarmctl.views.width import wrapped

    stream = err() if error else out()
    width = stream.width if stream.is_terminal else None
    lines = (text if isinstance(text, Text) else Text(text)).split("\n", allow_blank=True)
    indents = (len(line.plain) - len(line.plain.lstrip(" ")) + 4 for line in lines)
    fitting = [wrapped(line, width, indent) for line, indent in zip(lines, indents, strict=True)]
    stream.print(Text("\n").join(fitting))


def show_next(line: str, *, error: bool = False) -> None:
    """Print the command that comes next, after an ``error`` on stderr; nothing without one or a terminal."""
    from rich.text import Text

    stream = err() if error else out()
    if line and stream.is_terminal:
        stream.print(Text(f"next: {line}", "dim"))


def print_json(document: Any) -> None:
    """Print one JSON document on stdout."""
    json.dump(document, sys.stdout, indent=2, ensure_ascii=True)
    sys.stdout.write("\n")


def cannot_write(error: OSError, place: object) -> str:
    """Returns what to print about an error of writing to ``place``; that of a full disk names no file."""
    return f"cannot write {error.filename or place}: {error.strerror or error}"


def fail(message: str, *help_lines: str, code: int = exit_codes.ERROR) -> NoReturn:
    """Print an error and how to fix it on stderr, and exit with ``code``.

    Help with a command in it gets no line breaks, which the terminal would copy.
    """
    from rich.text import Text

    from swarmctl.views.escape import printable

    show(Text.assemble(("error", "bold red"), (f": {printable(message)}", "bold")), error=True)
    for line in help_lines:
        text = Text.assemble(("  help", "bold green"), f": {printable(line)}")
        if "swarmctl " in line:
            err().print(text)
        else:
            show(text, error=True)
    raise typer.Exit(code)


@contextmanager
def until_ctrl_c() -> Iterator[None]:
    """Ctrl-C is the normal end of what goes on in here: exit code 0."""
    try:
        yield
    except KeyboardInterrupt:
        raise typer.Exit(exit_codes.OK) from None


def print_diagnostics(diagnostics: Sequence[Diagnostic]) -> None:
    """Print findings on stderr, each with the lines of the file that it is about."""
    from swarmctl.views.findings import human

    if diagnostics:
        width = err().width if err().is_terminal else None
        err().print(human.findings(diagnostics, texts_of(diagnostics[: human.MOST_SHOWN]), width))


def texts_of(diagnostics: Sequence[Diagnostic]) -> dict[str, str]:
    """The texts, by file, of the readable files that the findings are in."""
    from swarmctl.yamltext.files import content

    spans = [span for found in diagnostics for span in (found.span, *(note.span for note in found.notes))]
    texts = {}
    for file in {span.file for span in spans if span}:
        with suppress(OSError):
            texts[file] = content(Path(file)).decode("utf-8-sig", errors="replace")
    return texts


def read_document(spec: SpecFiles) -> Document:
    """The checked document of a spec; prints its findings and exits if there are errors."""
    from swarmctl.cli.spec_fixes import with_fixes_counted
    from swarmctl.linter.runner import check_files

    document, found = check_files(*spec.files, workspaces=spec.workspaces)
    if document is None:
        refuse(spec, with_fixes_counted(spec, document, found))
    print_diagnostics(found.diagnostics)
    return document


def refuse(spec: SpecFiles, found: Checked) -> NoReturn:
    """Print the findings of a spec with errors, with ``--json`` also as JSON on stdout, and exit."""
    from swarmctl.views.findings import formats, human
    from swarmctl.views.findings.report import Report

    print_diagnostics(found.diagnostics)
    if _json.get():
        print(formats.json_document(Report((found,))), end="")
    err().print(human.verdict(found, passes=False))
    show_next(spec.fix_command(found.fixable, found.more_fixable), error=True)
    raise typer.Exit(exit_codes.ERROR)


def read_spec(spec: SpecFiles, lab: str = "") -> Swarm:
    """The resolved swarm of a spec; prints its findings and exits if there are errors.

    Builds of packages and WireGuard keys are those of its hosts, or of those of ``lab``.
    """
    return swarm_of(read_document(spec), lab)


def swarm_of(document: Document, lab: str = "") -> Swarm:
    """Returns the resolved swarm of a document, with the builds of its packages, and the keys of a lab."""
    from swarmctl.swarm.resolve import resolve

    swarm = resolve(document)
    if swarm.overlay and lab:
        from swarmctl.lab.lab_state import keys_of

        swarm = replace(swarm, wireguard_keys=keys_of(lab))
    if swarm.keys.expelled:  # the others do without them
        hosts = {
            name: replace(one, optional=one.optional or name in swarm.keys.expelled)
            for name, one in swarm.hosts.items()
        }
        swarm = replace(swarm, hosts=hosts)
    if swarm.packages:
        from swarmctl.deploy.build_store import with_builds

        swarm = with_builds(swarm, lab)
    return swarm
