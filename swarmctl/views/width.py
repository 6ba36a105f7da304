"""Fits text into the columns of a terminal: wraps lines, and cuts names in their middle."""

from __future__ import annotations

from collections.abc import Iterator

from rich.cells import cell_len
from rich.text import Text

_WITHIN = ",/"  # a word that is longer than a line is continued after one of these


def wrapped(line: Text, width: int | None, indent: int) -> Text:
    """``line`` in lines of at most ``width`` columns; those after the first begin with ``indent`` blanks.

    Without a width, the line stays as it is. Lines end at blanks; a word that is longer than a line is
    continued after a comma or slash, or cut.
    """
    if width is None or cell_len(line.plain) <= width:
        return line
    first, *rest = line.divide(_ends(line.plain, width, indent))
    made = first
    made.rstrip()
    for part in rest:
        part.rstrip()
        made.append("\n" + " " * indent).append_text(part)
    return made


def _ends(text: str, width: int, indent: int) -> Iterator[int]:
    """The offsets at which a new line begins."""
    start, used = 0, 0
    word, part = 0, 0  # the offsets behind the last blank, and behind the last mark within a word
    for offset, letter in enumerate(text):
        used += cell_len(letter)
        if used > width and letter != " ":
            end = text.find(" ", offset)
            whole = text[word : end if end >= 0 else len(text)]
            fits = (word,) if cell_len(whole) <= width - indent else (part, word)
            start = next((one for one in fits if text[start:one].strip()), offset)
            yield start
            used = indent + cell_len(text[start : offset + 1])
        if letter == " ":
            word = part = offset + 1
        elif letter in _WITHIN:
            part = offset + 1


def shortened(text: str, width: int) -> str:
    """``text`` in at most ``width`` columns, with dots for its middle."""
    if cell_len(text) <= width:
        return text
    kept = max(width - 3, 1)
    head, tail = text[: (kept + 1) // 2], text[len(text) - kept // 2 :]
    while cell_len(head) + cell_len(tail) > kept:
        head, tail = (head[:-1], tail) if cell_len(head) >= cell_len(tail) else (head, tail[1:])
    return f"{head}...{tail}"
