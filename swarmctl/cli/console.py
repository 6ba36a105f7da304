"""Output: results on stdout, everything else on stderr, with colour or without."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from contextvars import ContextVar
from enum import Enum
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import typer

from swarmctl.cli import exit_codes

if TYPE_CHECKING:
    from rich.console import Console

    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.diagnostics import Diagnostic
    from swarmctl.spec.load import Document
    from swarmctl.swarm.resolved import Swarm

WIDE = 240
_NARROWEST = 40  # a table in less has no text left; the terminal folds its lines


class Colour(str, Enum):
    """The values of ``--color``."""

    AUTO = "auto"
    ALWAYS = "always"
    NEVER = "never"


_colour = ContextVar("colour", default=Colour.AUTO)


def choose_colour(choice: Colour | None) -> None:
    """Set the colour mode of ``--color``; without it, the environment and the terminal decide."""
    if choice is not None:
        _colour.set(choice)


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


def print_json(document: Any) -> None:
    """Print one JSON document on stdout."""
    json.dump(document, sys.stdout, indent=2, ensure_ascii=True)
    sys.stdout.write("\n")


def fail(message: str, *help_lines: str, code: int = exit_codes.ERROR) -> NoReturn:
    """Print an error and how to fix it on stderr, and exit with ``code``."""
    from rich.text import Text

    from swarmctl.views.escape import printable

    err().print(Text.assemble(("error", "bold red"), (f": {printable(message)}", "bold")))
    for line in help_lines:
        err().print(Text.assemble(("  help", "bold green"), f": {printable(line)}"))
    raise typer.Exit(code)


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
    from swarmctl.cli.spec_fixes import checked
    from swarmctl.rules.runner import load_checked
    from swarmctl.views.findings import human

    document, diagnostics = load_checked(*spec.files, workspaces=spec.workspaces)
    print_diagnostics(diagnostics)
    if document is None:
        err().print(human.verdict(checked(spec), passes=False))
        raise typer.Exit(exit_codes.ERROR)
    return document


def read_spec(spec: SpecFiles) -> Swarm:
    """The resolved swarm of a spec; prints its findings and exits if there are errors."""
    from swarmctl.swarm.resolve import resolve

    return resolve(read_document(spec))
