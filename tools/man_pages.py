"""Writes a manual page for every verb from the command line parser: ``python tools/man_pages.py FOLDER``."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from swarmctl import __version__
from swarmctl.cli.app import app

_TYPE = re.compile(r" <\w+>$")  # the class that an argument becomes


def pages() -> Iterator[tuple[str, str]]:
    """The name and the text of each page, ``swarmctl`` first, then those of its verbs."""
    yield from _pages(typer.main.get_command(app), "swarmctl", None)


def _pages(command: Any, path: str, parent: Any) -> Iterator[tuple[str, str]]:
    whole = command.load() if hasattr(command, "load") else command
    context = whole.make_context(path, [], parent=parent, resilient_parsing=True)
    yield path.replace(" ", "-"), _page(whole, context, path)
    for name, one in getattr(whole, "commands", {}).items():
        yield from _pages(one, f"{path} {name}", context)


def _page(command: Any, context: Any, path: str) -> str:
    name = path.replace(" ", "-")
    summary, *more = (command.help or "").strip().split("\n\n")
    usage = " ".join(command.collect_usage_pieces(context))
    lines = [
        f'.TH "{name.upper()}" 1 "" "swarmctl {__version__}" "swarmctl"',
        ".SH NAME", f"{_text(name)} \\- {_text(summary.split('. ')[0].rstrip('.'))}",
        ".SH SYNOPSIS", f".B {_text(path)}", _text(usage),
        ".SH DESCRIPTION", _text(summary),
    ]  # fmt: skip
    for part in more:
        lines += [".PP", _text(part)]
    records = [one for param in command.get_params(context) if (one := param.get_help_record(context))]
    lines += _listed("OPTIONS", records)
    verbs = getattr(command, "commands", {})
    lines += _listed("COMMANDS", [(word, one.get_short_help_str(400)) for word, one in verbs.items()])
    if command.epilog:
        lines += [".SH EXIT STATUS", _text(command.epilog.partition(": ")[2])]
    if verbs:
        named = ", ".join(f"{name}-{word}(1)" for word in verbs)
        lines += [".SH SEE ALSO", _text(named)]
    return "\n".join(lines) + "\n"


def _listed(heading: str, records: list[tuple[str, str]]) -> list[str]:
    lines = [f".SH {heading}"] if records else []
    for term, meaning in records:
        lines += [".TP", f"\\fB{_text(_TYPE.sub('', term))}\\fR", _text(meaning or " ")]
    return lines


def _text(text: str) -> str:
    """``text`` as one line that troff shows as it is."""
    line = " ".join(text.split()).replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{line}" if line.startswith((".", "'")) else line


def main() -> None:
    """Writes all pages to the folder that is named."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages():
        (folder / f"{name}.1").write_text(text, "utf-8")


if __name__ == "__main__":
    main()
