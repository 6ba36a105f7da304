"""Diagnostics for people: what is wrong, the line it stands on, what belongs to it, how to mend it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.text import Text

from swarmctl.spec.diagnostics import Diagnostic, Severity, Span
from swarmctl.views.text import printable

_STYLE = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow"}
_GUTTER = "bold blue"
_WIDEST = 160


def diagnostic(found: Diagnostic, sources: Mapping[str, str]) -> Text:
    """One finding as several lines. ``sources`` maps file names to their text, for the excerpt."""
    style = _STYLE[found.severity]
    text = Text.assemble(
        (f"{found.severity.value}[{found.code}]", style), (f": {printable(found.message)}", "bold"), "\n"
    )
    if found.span is None:
        return _with_help(text, found, 0)
    marks = [
        (found.span, found.label, "^", style),
        *((note.span, note.text, "-", _GUTTER) for note in found.notes),
    ]
    width = len(str(max(span.line for span, *_ in marks)))
    text.append(f"{' ' * width}--> ", _GUTTER).append(f"{printable(str(found.span))}\n")
    lines = sources.get(found.span.file, "").splitlines()
    same_file = [mark for mark in marks if mark[0].file == found.span.file]
    text.append(f"{' ' * width} |\n", _GUTTER)
    last = 0
    for span, label, mark, mark_style in sorted(same_file, key=lambda one: one[0].line):
        if last and span.line > last + 1:
            text.append("...\n", _GUTTER)
        if span.line != last:
            text.append(f"{span.line:>{width}} | ", _GUTTER).append(f"{_line(lines, span.line)}\n")
        last = span.line
        text.append(f"{' ' * width} | ", _GUTTER)
        text.append(
            f"{' ' * _indent(lines, span)}{mark * _length(lines, span)} {printable(label)}".rstrip() + "\n",
            mark_style,
        )
    for span, label, *_ in marks:
        if span.file != found.span.file:
            text.append(f"{' ' * width}::: ", _GUTTER).append(f"{printable(str(span))} {printable(label)}\n")
    return _with_help(text, found, width)


def summary(diagnostics: Sequence[Diagnostic]) -> str:
    """``2 errors, 1 warning``."""
    counted = []
    for severity in Severity:
        count = sum(found.severity is severity for found in diagnostics)
        if count:
            counted.append(f"{count} {severity.value}{'s' if count > 1 else ''}")
    return ", ".join(counted)


def _with_help(text: Text, found: Diagnostic, width: int) -> Text:
    for line in found.help:
        text.append(f"{' ' * width} = ", _GUTTER).append("help", "bold green").append(
            f": {printable(line)}\n"
        )
    return text


def _line(lines: Sequence[str], number: int) -> str:
    text = lines[number - 1] if 0 < number <= len(lines) else ""
    shown = printable(text)
    return shown if len(shown) <= _WIDEST else shown[: _WIDEST - 3] + "..."


def _indent(lines: Sequence[str], span: Span) -> int:
    before = lines[span.line - 1][: span.column - 1] if 0 < span.line <= len(lines) else ""
    return min(len(printable(before)), _WIDEST)


def _length(lines: Sequence[str], span: Span) -> int:
    """How many marks stand under the span: to its end, or to the end of its first line."""
    line = lines[span.line - 1] if 0 < span.line <= len(lines) else ""
    end = span.end_column - 1 if span.end_line == span.line else len(line)
    return max(1, min(len(printable(line[span.column - 1 : end])), _WIDEST))
