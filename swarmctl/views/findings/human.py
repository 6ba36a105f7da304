"""Findings as terminal text: the error, its source line, related lines and the remedy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.text import Text

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.rulebook import Severity
from swarmctl.views.escape import printable
from swarmctl.views.findings.excerpt import View, clipped, covered, marked, view
from swarmctl.views.findings.report import Checked, counted, fixes_in, remedies

MOST_SHOWN = 50
_STYLE = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow"}
_GUTTER = "bold blue"
_WIDEST = 160  # cells of a source line, where the output has no width of its own
_NARROWEST = 12


def findings(diagnostics: Sequence[Diagnostic], sources: Mapping[str, str], width: int | None = None) -> Text:
    """Returns the first ``MOST_SHOWN`` findings in full, and the number of the others."""
    secrets = [one.span for one in diagnostics if one.secret and one.span is not None]
    lines = {file: covered(file, text.splitlines(), secrets) for file, text in sources.items()}
    text = Text("\n").join(finding(one, lines, width) for one in diagnostics[:MOST_SHOWN])
    if len(diagnostics) > MOST_SHOWN:
        text.append(f"\n... and {len(diagnostics) - MOST_SHOWN} more")
    return text


def finding(found: Diagnostic, lines: Mapping[str, Sequence[str]], width: int | None = None) -> Text:
    """One finding as several lines. ``lines`` are those of each file, for the excerpt."""
    text = Text.assemble(
        (f"{found.severity.value}[{found.code}]", _STYLE[found.severity]),
        (f": {printable(found.message)}\n", "bold"),
    )
    gutter = 0
    if found.span is not None:
        gutter = len(str(max(span.line for span in (found.span, *(note.span for note in found.notes)))))
        text.append(f"{' ' * gutter}--> ", _GUTTER).append(printable(str(found.span)))
        if found.span.file in lines:
            columns = max(_NARROWEST, width - gutter - len(" | ")) if width else _WIDEST
            text.append("\n").append(_excerpt(found, found.span, lines[found.span.file], gutter, columns))
        else:
            text.append(f" {printable(found.label)}".rstrip() + "\n")
    for note in found.notes:
        if found.span is None or note.span.file != found.span.file or note.span.file not in lines:
            text.append(f"{' ' * gutter}::: ", _GUTTER)
            text.append(f"{printable(str(note.span))} {printable(note.text)}\n")
    for what, line in remedies(found):
        text.append(f"{' ' * gutter} = ", _GUTTER).append(what, "bold green")
        text.append(f": {printable(line)}\n")
    return text


def verdict(one: Checked, *, passes: bool) -> str:
    """Returns one line: whether a spec is valid, and what it describes."""
    found, fixable, spec = counted(one.diagnostics), fixes_in([one]), printable(one.spec)
    if one.document is None or not passes:
        strict = ", and --strict allows none" if one.document else ""
        return f"{found}{f' ({fixable})' if fixable else ''} in {spec}{strict}"
    counts = "; ".join(filter(None, (found, fixable)))
    swarm = one.document.spec
    return (
        f"{spec}: swarm `{swarm.name}` is valid{f' ({counts})' if counts else ''}: "
        f"{_number(len(swarm.robots), 'robot')} on {_number(len(swarm.hosts), 'host')}, "
        f"mode {swarm.mode.value}"
    )


def _number(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _excerpt(found: Diagnostic, place: Span, lines: Sequence[str], gutter: int, columns: int) -> Text:
    """The lines of the finding's file that it is about, each with marks and a label under it."""
    marks = [
        (place, found.label, "^", _STYLE[found.severity]),
        *((note.span, note.text, "-", _GUTTER) for note in found.notes if note.span.file == place.file),
    ]
    text = Text().append(f"{' ' * gutter} |\n", _GUTTER)
    last, shown = 0, View("", 0, 0)
    for span, label, mark, style in sorted(marks, key=lambda one: one[0].line):
        whole = lines[span.line - 1] if 0 < span.line <= len(lines) else ""
        line, part = clipped(whole, span)
        first, end = marked(line, part)
        if last and span.line > last + 1:
            text.append("...\n", _GUTTER)
        if span.line != last or line is not whole or not shown.shows(first):
            shown = view(line, first, end, columns)
            text.append(f"{span.line:>{gutter}} | ", _GUTTER).append(f"{shown.text}\n")
        last = span.line
        before, length = shown.under(first, end)
        text.append(f"{' ' * gutter} | ", _GUTTER)
        text.append(f"{' ' * before}{mark * length} {printable(label)}".rstrip() + "\n", style)
    return text
