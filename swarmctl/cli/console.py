"""Where output goes: results to stdout, everything about them to stderr. Colour only where it is wanted."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from swarmctl.cli import exits

if TYPE_CHECKING:
    from rich.console import Console

    from swarmctl.spec.diagnostics import Diagnostic
    from swarmctl.topology.swarm import Swarm

MOST_SHOWN = 50
WIDE = 240


@cache
def out() -> Console:
    """Results. What is not a terminal has no width of its own: tables are not folded there."""
    from rich.console import Console

    width = None if sys.stdout.isatty() else WIDE
    return Console(width=width, soft_wrap=True, highlight=False, markup=False, emoji=False)


@cache
def err() -> Console:
    from rich.console import Console

    return Console(stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False)


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
    """Findings on stderr, in full for the first ``MOST_SHOWN``."""
    from swarmctl.views import diagnostics as view

    texts: dict[str, str] = {}
    for found in diagnostics[:MOST_SHOWN]:
        for span in [found.span, *(note.span for note in found.notes)]:
            if span is not None and span.file not in texts:
                texts[span.file] = _text_of(span.file)
        err().print(view.diagnostic(found, texts))
    if len(diagnostics) > MOST_SHOWN:
        err().print(f"... and {len(diagnostics) - MOST_SHOWN} more")


def _text_of(file: str) -> str:
    try:
        return Path(file).read_text("utf-8-sig", errors="replace")
    except OSError:
        return ""


def read_spec(spec: Path) -> Swarm:
    """The resolved swarm of a spec file; with errors in it, they are shown and the program ends."""
    from swarmctl.checks.check import read
    from swarmctl.topology.modes import READY
    from swarmctl.views import diagnostics as view

    swarm, diagnostics = read(spec)
    print_diagnostics(diagnostics)
    if swarm is None:
        err().print(f"{view.summary(diagnostics)} in {spec}")
        raise typer.Exit(exits.ERROR)
    if swarm.mode not in READY:
        ready = ", ".join(f"`{one.value}`" for one in READY)
        fail(f"mode `{swarm.mode.value}` can be checked, but not deployed yet", f"today's modes: {ready}")
    return swarm
