"""One line of a source text as a terminal shows it: how wide it is, and the part of it that fits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from rich.cells import cell_len

from swarmctl.diagnostics import Span
from swarmctl.views.escape import printable

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
