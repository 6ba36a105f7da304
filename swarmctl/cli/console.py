"""Where output goes: results to stdout, everything about them to stderr. Colour only where it is wanted."""

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

from swarmctl.cli import exits

if TYPE_CHECKING:
    from rich.console import Console

    from swarmctl.cli.layers import Layers
    from swarmctl.spec.diagnostics import Diagnostic
    from swarmctl.spec.load import Document
    from swarmctl.topology.swarm import Swarm

WIDE = 240


class Colour(str, Enum):
    AUTO = "auto"
    ALWAYS = "always"
    NEVER = "never"


_colour = ContextVar("colour", default=Colour.AUTO)


def choose_colour(asked: Colour | None) -> None:
    """What ``--color`` says; without it the environment decides, and whether somebody looks."""
    if asked is not None:
        _colour.set(asked)


def out() -> Console:
    """Results. What is not a terminal has no width of its own: tables are not folded there."""
    return _console(stderr=False, terminal=sys.stdout.isatty(), coloured=_coloured(sys.stdout))


def err() -> Console:
    return _console(stderr=True, terminal=sys.stderr.isatty(), coloured=_coloured(sys.stderr))


def _coloured(stream: TextIO) -> bool:
    """https://no-color.org and https://force-color.org: a variable that is set to nothing is not set."""
    if (asked := _colour.get()) is not Colour.AUTO:
        return asked is Colour.ALWAYS
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (stream.isatty() and os.environ.get("TERM") != "dumb")


@cache
def _console(*, stderr: bool, terminal: bool, coloured: bool) -> Console:
    """One console for each stream, so that what is printed beside a live display stays above it."""
    from rich.console import Console

    dumb = not terminal or os.environ.get("TERM") == "dumb"
    return Console(
        stderr=stderr,
        force_terminal=terminal,
        color_system=None if not coloured else "standard" if dumb else "auto",
        no_color=False,
        width=None if stderr or terminal else WIDE,
        soft_wrap=True,
        highlight=False,
        markup=False,
        emoji=False,
    )


def print_json(document: Any) -> None:
    """One JSON document on stdout, and nothing else there."""
    json.dump(document, sys.stdout, indent=2, ensure_ascii=True)
    sys.stdout.write("\n")


def fail(message: str, *help_lines: str, code: int = exits.ERROR) -> NoReturn:
    """Say on stderr what went wrong and how to mend it, and end with ``code``."""
    from rich.text import Text

    from swarmctl.views.text import printable

    err().print(Text.assemble(("error", "bold red"), (f": {printable(message)}", "bold")))
    for line in help_lines:
        err().print(Text.assemble(("  help", "bold green"), f": {printable(line)}"))
    raise typer.Exit(code)


def print_diagnostics(diagnostics: Sequence[Diagnostic]) -> None:
    """Findings on stderr, each with the lines of text that it is about."""
    from swarmctl.views.findings import human

    if diagnostics:
        width = err().width if err().is_terminal else None
        err().print(human.findings(diagnostics, texts_of(diagnostics[: human.MOST_SHOWN]), width))


def texts_of(diagnostics: Sequence[Diagnostic]) -> dict[str, str]:
    """The texts of the files that findings point into, of those that can be read."""
    spans = [span for found in diagnostics for span in (found.span, *(note.span for note in found.notes))]
    texts = {}
    for file in {span.file for span in spans if span}:
        with suppress(OSError):
            texts[file] = Path(file).read_text("utf-8-sig", errors="replace")
    return texts


def read_document(spec: Layers) -> Document:
    """The document of a spec; with errors in it, they are shown and the program ends."""
    from swarmctl.checks.check import examine
    from swarmctl.views.findings import human
    from swarmctl.views.findings.report import Checked

    document, diagnostics = examine(*spec.files)
    print_diagnostics(diagnostics)
    if document is None:
        err().print(human.verdict(Checked(str(spec), None, diagnostics), passes=False))
        raise typer.Exit(exits.ERROR)
    return document


def read_spec(spec: Layers) -> Swarm:
    """The resolved swarm of a spec; with errors in it, they are shown and the program ends."""
    from swarmctl.topology.resolve import resolve

    return resolve(read_document(spec))
