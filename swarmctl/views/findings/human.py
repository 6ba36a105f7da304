"""Findings as terminal text: the error, its source line, related lines and the remedy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from rich.cells import cell_len
from rich.text import Text

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.rulebook import Severity
from swarmctl.views.escape import printable
from swarmctl.views.findings.report import Checked, counted, fixes_in, remedies

_CUT = "..."
_LONGEST = 2_000  # letters of a line that are measured; no terminal shows as many
_BEFORE = 500  # of them at most before the place of a finding


@dataclass(frozen=True)
class View:
    """What is shown of a line: its text, and the cells of the line that it covers (the end exclusive)."""

    text: str
    start: int
    end: int
    cut_left: bool = False

    def shows(self, cell: int) -> bool:
        """Returns True if the cell lies in the visible part of the line."""
        return self.start <= cell < self.end

    def under(self, first: int, last: int) -> tuple[int, int]:
        """How many blanks and how many marks stand under the cells from ``first`` to before ``last``."""
        before = first - self.start + (len(_CUT) if self.cut_left else 0)
        return before, max(1, min(last, self.end) - first)


def covered(file: str, lines: Sequence[str], secrets: Iterable[Span]) -> Sequence[str]:
    """The lines of a file with what nobody should read covered by stars, each line as long as it was."""
    shown = list(lines)
    for span in secrets:
        for number in range(span.line, span.end_line + 1) if span.file == file else ():
            if number > len(shown):
                break
            line = shown[number - 1]
            first = span.column - 1 if number == span.line else 0
            last = min(span.end_column - 1 if number == span.end_line else len(line), len(line))
            shown[number - 1] = f"{line[:first]}{'*' * (last - first)}{line[last:]}"
    return shown


def clipped(line: str, span: Span) -> tuple[str, Span]:
    """The part of a very long line that can be shown, and where ``span`` lies in it.

    A file may be one line of megabytes, and measuring each of its letters takes seconds.
    """
    start = max(0, span.column - _BEFORE)
    if start + len(line) <= _LONGEST:
        return line, span
    end = span.end_column - start if span.end_line == span.line else 1
    return line[start : start + _LONGEST], replace(span, column=span.column - start, end_column=max(1, end))


def cells(text: str) -> int:
    """How many columns of a terminal ``text`` takes: East Asian letters take two, combining ones none."""
    shown = printable(text)
    return len(shown) if shown.isascii() else sum(map(cell_len, shown))


def marked(line: str, span: Span) -> tuple[int, int]:
    """The cells of ``line`` that ``span`` underlines: to its end, or to the end of its first line."""
    first = cells(line[: span.column - 1])
    last = cells(line[: span.end_column - 1]) if span.end_line == span.line else cells(line)
    return first, max(first + 1, last)


def view(line: str, first: int, last: int, columns: int) -> View:
    """``line`` whole where it fits into ``columns`` cells, else the part around its marked cells."""
    shown, width = printable(line), cells(line)
    if width <= columns:
        return View(shown, 0, max(width + 1, last))  # a mark may stand behind the last letter
    start = 0
    if min(last, first + columns // 2) > columns - len(_CUT):
        start = max(0, min(first - columns // 4, width - (columns - len(_CUT))))
    left = len(_CUT) if start else 0
    end = start + columns - left
    if end < width:
        end -= len(_CUT)
    part = _part(shown, start, end)
    return View(f"{_CUT * bool(start)}{part}{_CUT * (end < width)}", start, end, cut_left=start > 0)


def _part(shown: str, start: int, end: int) -> str:
    """The cells from ``start`` to before ``end``; half of a wide letter is a blank."""
    part, at = [], 0
    for char in shown:
        after = at + cell_len(char)
        if at >= start and after <= end:
            part.append(char)
        elif at < end and after > start:
            part.append(" " * (min(after, end) - max(at, start)))
        at = after
        if at >= end:
            break
    return "".join(part)


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
