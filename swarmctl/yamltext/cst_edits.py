"""Text changes for one part of a YAML text, computed on its layout. Knows no data."""

from __future__ import annotations

from collections.abc import Sequence

from swarmctl.yamltext.cst import Entry, Layout, Part

Stroke = tuple[int, int, str]  # replaces the text between two offsets
Strokes = tuple[Stroke, ...]


def replaced(layout: Layout, part: Part, written: str) -> Strokes:
    """Replaces the value ``part``."""
    if part.empty:
        behind_colon = layout.text[part.slot - 1 : part.slot] in (":", "-")
        return ((part.slot, part.slot, f" {written}" if behind_colon else f": {written}"),)
    if _begins_beside_slot(layout, part):
        return ((part.start, part.end, written),)
    return (part.slot, part.slot, f" {written}"), _lines(layout, part.start, part.end)


def inserted(layout: Layout, part: Part, written: str, place: int = -1) -> Strokes:
    """Inserts an entry into a collection, after the one at ``place``."""
    if not part.entries:
        padding = layout.text[part.start + 1 : part.end - 1]
        if padding.strip(" "):  # a comment is between the brackets
            return ((part.start + 1, part.start + 1, f"{written} "),)
        opening, closing = layout.text[part.start], layout.text[part.end - 1]
        return ((part.start, part.end, f"{opening}{padding}{written}{padding}{closing}"),)
    before = part.entries[place]
    if part.flow:
        return _inserted_in_flow(layout, part, before, written)
    indent = " " * (before.begin - layout.line_start(before.begin))
    line_end = layout.line_end(before.end)
    return ((line_end, line_end, f"{layout.line_break(line_end)}{indent}{written}"),)


def _inserted_in_flow(layout: Layout, part: Part, before: Entry, written: str) -> Strokes:
    line_end = layout.line_end(before.comma or before.end)
    if not _begins_line(layout, before.begin) or part.end <= line_end:
        return ((before.end, before.end, f", {written}"),)
    line_start = layout.line_start(before.begin)
    line = f"{layout.line_break(line_end)}{layout.text[line_start : before.begin]}{written}"
    if before.comma is not None:
        return ((line_end, line_end, f"{line},"),)
    if before.end == line_end:
        return ((line_end, line_end, f",{line}"),)
    return (before.end, before.end, ","), (line_end, line_end, line)


def inserted_block(layout: Layout, part: Part, key: str, items: Sequence[str]) -> Strokes:
    """Appends a key to a file, with one line for each of its entries."""
    end = layout.line_end(part.end)
    line_break = layout.line_break(end)
    gap = line_break if _has_gaps(layout, part) else ""
    return ((end, end, f"{line_break}{gap}{line_break.join([f'{key}:', *(f'  {one}' for one in items)])}"),)


def _has_gaps(layout: Layout, part: Part) -> bool:
    """True if empty lines separate the entries of a file."""
    starts = (layout.line_start(entry.begin) for entry in part.entries)
    return any(start and not layout.text[layout.line_start(start - 1) : start].strip() for start in starts)


def removed(layout: Layout, part: Part, place: int) -> Strokes:
    """Removes one entry of a collection, with the comment on its line."""
    entry = part.entries[place]
    if len(part.entries) == 1 and not part.flow:
        return _emptied(layout, part)
    if part.flow:
        return (_removed_from_flow(layout, part, place),)
    if _begins_line(layout, entry.begin):
        return (_lines(layout, entry.begin, entry.end),)
    following = part.entries[place + 1].begin  # the first entry follows a dash; the next one moves there
    if layout.line_start(following) == layout.next_line(entry.end):
        return ((entry.begin, following, ""),)
    return ((entry.begin, layout.line_end(entry.end), ""),)


def _removed_from_flow(layout: Layout, part: Part, place: int) -> Stroke:
    entry, last = part.entries[place], place == len(part.entries) - 1
    end = entry.comma or entry.end
    closed = last or entry.comma is not None
    alone = _begins_line(layout, entry.begin) and closed and _ends_line(layout, end)
    if alone:
        return _lines(layout, entry.begin, end)
    if not last:
        return entry.begin, part.entries[place + 1].begin, ""
    if place:
        return part.entries[place - 1].end, entry.end, ""
    return entry.begin, end, ""


def _emptied(layout: Layout, part: Part) -> Strokes:
    nothing = "{}" if part.kind == "mapping" else "[]"
    if _begins_beside_slot(layout, part):
        return ((part.entries[0].begin, part.end, nothing),)
    return (part.slot, part.slot, f" {nothing}"), _lines(layout, part.start, part.end)


def _begins_beside_slot(layout: Layout, part: Part) -> bool:
    """True if a value is on the line of its colon or dash."""
    return part.flow or part.kind == "scalar" or layout.line(part.slot) == layout.line(part.start)


def _lines(layout: Layout, start: int, end: int) -> Stroke:
    """Deletes whole lines; of the last line of a file also the line break before it."""
    first, behind = layout.line_start(start), layout.next_line(end)
    if layout.line_end(end) == behind and first:
        before = layout.lines[layout.line(first) - 1]
        return layout.line_end(before), behind, ""
    return first, behind, ""


def _begins_line(layout: Layout, offset: int) -> bool:
    return not layout.text[layout.line_start(offset) : offset].strip()


def _ends_line(layout: Layout, offset: int) -> bool:
    rest = layout.text[offset : layout.line_end(offset)].strip()
    return not rest or rest.startswith("#")
