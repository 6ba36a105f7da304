"""Minimal edits of a spec's text at a place of its data: comments, order, quotes and layout stay.

Rules use them to build the ``fix`` of a diagnostic with ``make_fix``:

    set_key(source, ("robots", "k3"), "host", "k3-pi")        a new key of a mapping (or its new value)
    append_item(source, ("links", 0, "hosts"), "k3-pi")       one more item of a list
    replace_value(source, ("hosts", "k3-pi", "port"), 22)     another value
    exchange(source, ("links", 1, "mac"), ("links", 2, "mac"), ...)   two values, each in the other's place
    rename_key(source, ("hosts", "k3-pi", "adress"), "address")
    put(source, ("robots", "k3", "settings", "limits", "linear"), 0.1)   the same, with the mappings above it
    remove(source, ("links", 3))                              a key with its value, or an item
    as_text(source, ("links", 1, "usb", "serial"))            the same word in quotes

``spec.references.rename`` renames something and every reference to it. A change that the text does not allow
(behind an alias, of one element of a range, of what a variable means) is an empty tuple, and ``make_fix``
returns None for it. An edit of what a range writes once for several entries counts these as its ``copies``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import yaml

from swarmctl.diagnostics import Edit, Fix, Span
from swarmctl.yamltext import hostlist
from swarmctl.yamltext.compose import Replaced, removal_of
from swarmctl.yamltext.cst import Entry, Kind, Layout, Part, layout, line_starts
from swarmctl.yamltext.files import MAX_FIXABLE
from swarmctl.yamltext.scalars import literal, text_of
from swarmctl.yamltext.selection_text import is_selection
from swarmctl.yamltext.source import Loc, Source

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


Edits = tuple[Edit, ...]

_QUOTES = ("'", '"')
_KINDS: dict[type[yaml.Node], Kind] = {
    yaml.ScalarNode: "scalar",
    yaml.MappingNode: "mapping",
    yaml.SequenceNode: "sequence",
}


def make_fix(title: str, *parts: Edits, safe: bool) -> Fix | None:
    """Returns a fix of several changes, or None if one of them is not possible, or not beside another."""
    edits = joined(parts)
    return Fix(title, edits, safe) if edits and all(parts) else None


def joined(parts: Iterable[Edits]) -> Edits:
    """Returns edits that are made together, none if two of them overlap.

    Equal ones, of the elements of a range, become one.
    """
    counts = Counter(edit for part in parts for edit in part)
    spans = sorted(edit.span for edit in counts)
    if any(
        one.file == other.file and (other.line, other.column) < (one.end_line, one.end_column)
        for one, other in pairwise(spans)
    ):
        return ()
    return tuple(edit if edit.copies > count else replace(edit, copies=1) for edit, count in counts.items())


def replace_value(source: Source, loc: Loc, value: Any) -> Edits:
    """Returns the edit that replaces a value."""
    found = _find(source, loc)
    if found is None or found.in_list_of_range or isinstance(found.node, Replaced):
        return ()
    quote = found.part.style if found.part.style in _QUOTES else ""
    return found.edits(replaced(found.layout, found.part, literal(value, quote)))


def exchange(source: Source, one: Loc, other: Loc, *values: Any) -> Edits:
    """Returns the edits that exchange two values, ``values``: of one range, within the range."""
    first, second = _find(source, one), _find(source, other)
    if first is None or second is None:
        return ()
    if (first.file, first.part.start) != (second.file, second.part.start):
        both = replace_value(source, one, values[1]), replace_value(source, other, values[0])
        return joined(both) if all(both) else ()
    found = hostlist.read(first.part.value)
    text = found.exchanged(*map(str, values)) if isinstance(found, hostlist.Range) else ""
    quote = first.part.style if first.part.style in _QUOTES else ""
    made = first.edits(replaced(first.layout, first.part, literal(text, quote))) if text else ()
    return tuple(replace(edit, copies=1) for edit in made)


def as_text(source: Source, loc: Loc) -> Edits:
    """Returns the edit that puts quotes around a scalar, so that it is text."""
    word = written(source, loc)
    return replace_value(source, loc, word) if word else ()


def written(source: Source, loc: Loc) -> str:
    """Returns the scalar at ``loc`` as it is written: ``0403`` where the data has a number."""
    found = _find(source, loc)
    return found.part.value if found and found.exact and found.part.kind == "scalar" else ""


def rename_key(source: Source, loc: Loc, name: str) -> Edits:
    """Returns the edit that renames the key of the value at ``loc``."""
    found = _find(source, loc)
    key = found.holder.entries[found.number].key if found and found.holder else None
    if found is None or key is None or not found.own_key:
        return ()
    return found.edits(((key.start, key.end, text_of(name, key.style)),))


def set_key(source: Source, loc: Loc, key: str, value: Any, *, after: str = "") -> Edits:
    """Returns the edit that adds a key to the mapping at ``loc``: after ``after`` if present, else last."""
    found = _find(source, loc)
    if found is None:
        return ()
    if source.child(found.node, key) is not None:
        return replace_value(source, (*loc, key), value)
    if (removal := removal_of(found.node, key)) is not None:  # the file has the key: it would be there twice
        there = _place(source, *removal)
        return there.edits(replaced(there.layout, there.part, literal(value))) if there else ()
    if found.part.empty:
        return replace_value(source, loc, {key: value})
    keys = [entry.key for entry in found.part.entries if entry.key and not entry.explicit]
    names = [one.value for one in keys]
    if found.part.kind != "mapping" or len(keys) < len(found.part.entries):
        return ()
    quote = keys[-1].style if keys else ""
    if not loc and not found.part.flow and value and isinstance(value, (Mapping, list, tuple)):
        return found.edits(inserted_block(found.layout, found.part, text_of(key, quote), _lines_of(value)))
    place = names.index(after) if after in names else -1
    written = f"{text_of(key, quote)}: {literal(value, quote if found.part.flow else '')}"  # JSON stays JSON
    return found.edits(inserted(found.layout, found.part, written, place))


def put(source: Source, loc: Loc, value: Any) -> Edits:
    """Returns the edit that sets the value at ``loc``, with the mappings above it that are missing."""
    node, depth = source.root, 0
    while depth < len(loc) and (found := source.child(node, loc[depth])) is not None:
        node, depth = found[1], depth + 1
    if depth == len(loc):
        return replace_value(source, loc, value)
    missing = loc[depth:]
    if not all(isinstance(one, str) for one in missing):
        return ()
    for key in reversed(missing[1:]):
        value = {key: value}
    return set_key(source, loc[:depth], str(missing[0]), value)


def append_item(source: Source, loc: Loc, value: Any) -> Edits:
    """Returns the edit that appends an item to the list at ``loc``; none if it leaves names out: `!k3`."""
    found = _find(source, loc)
    if found is None or any("!" in entry.value.value for entry in found.part.entries):
        return ()
    if found.part.empty:
        return replace_value(source, loc, [value])
    if found.part.kind != "sequence":
        return ()
    last = found.part.entries[-1].value.style if found.part.entries else ""
    written = literal(value, last if last in _QUOTES else "")
    written = written if found.part.flow else f"- {written}"
    return found.edits(inserted(found.layout, found.part, written))


def remove(source: Source, loc: Loc) -> Edits:
    """Returns the edit that removes a key with its value, or an item, with the comment on its line."""
    found = _find(source, loc)
    if found is None or found.holder is None or not found.own_key or found.in_list_of_range:
        return ()
    return found.edits(removed(found.layout, found.holder, found.number))


def apply(text: str, edits: Iterable[Edit]) -> str:
    """Applies ``edits`` to ``text``, whose spans they have. Raises ValueError if two of them overlap."""
    lines = line_starts(text)
    done, pieces = 0, []
    for edit in sorted(edits, key=lambda edit: edit.span):
        start = lines[edit.span.line - 1] + edit.span.column - 1
        if start < done:
            raise ValueError("two edits overlap")
        pieces += [text[done:start], edit.text]
        done = lines[edit.span.end_line - 1] + edit.span.end_column - 1
    return "".join([*pieces, text[done:]])


class _Place(NamedTuple):
    """A value in a file, with its collection and its index in it.

    A range or a selection writes several values as one text: ``copies`` counts them. Then the text may not be
    ``exact`` the value, nor its key ``own_key`` that of the value, or several items of a list are one text.
    """

    node: yaml.Node
    file: str
    layout: Layout
    part: Part
    holder: Part | None
    number: int
    copies: int
    exact: bool = True
    own_key: bool = True
    in_list_of_range: bool = False

    @property
    def is_selected(self) -> bool:
        """True for a name that a selection means: the text decides about others too."""
        return not self.exact and is_selection(self.part.value)

    def edits(self, strokes: Strokes) -> Edits:
        return tuple(Edit(self._span(start, end), written, self.copies) for start, end, written in strokes)

    def _span(self, start: int, end: int) -> Span:
        lines, first, last = self.layout.lines, self.layout.line(start), self.layout.line(end)
        return Span(self.file, first + 1, start - lines[first] + 1, last + 1, end - lines[last] + 1)


def _find(source: Source, loc: Loc) -> _Place | None:
    """Returns the place of ``loc`` if the text holds it once, without aliases; ranges may copy it."""
    key, node = None, source.root
    place = _place(source, None, node)
    for step in loc:
        pair = source.child(node, step)
        if place is None or pair is None:
            return None
        in_list_of_range = _is_one_of_a_range(node, step)
        key, node = pair
        place = _place(source, key, node)
        if place is not None and (in_list_of_range or place.is_selected):
            place = place._replace(in_list_of_range=True)
    return place


def _is_one_of_a_range(holder: yaml.Node | None, step: str | int) -> bool:
    """True if an item of a list comes from a range together with its neighbours."""
    if not isinstance(holder, yaml.SequenceNode) or not isinstance(step, int):
        return False
    around = [item.start_mark for item in holder.value[max(0, step - 1) : step + 2]]
    return len({(mark.name, mark.index) for mark in around}) < len(around)


def _place(source: Source, key: yaml.Node | None, node: yaml.Node | None) -> _Place | None:
    if node is None:
        return None
    file = node.start_mark.name
    if any(len(source.texts[one.start_mark.name]) > MAX_FIXABLE for one in (key, node) if one is not None):
        return None
    found = layout(source.texts[file])
    kind = next(kind for type_, kind in _KINDS.items() if isinstance(node, type_))
    part = found.parts.get((node.start_mark.index, kind))
    if part is None or part.anchor in found.aliased or (part.flow and found.text[part.start] not in "[{"):
        return None
    copies, exact = source.copies(node), kind != "scalar" or part.value == node.value
    if key is None:
        return _Place(node, file, found, part, None, 0, copies, exact)
    beside = layout(source.texts[key.start_mark.name])
    held = (beside.items if key is node else beside.keys).get(key.start_mark.index)
    if held is None:
        return None
    holder, number = held
    name = holder.entries[number].key
    own_key = name is None or name.value == key.value
    return _Place(
        node, file, found, part, holder if beside is found else None, number, copies, exact, own_key
    )


def _lines_of(value: Any) -> list[str]:
    """Returns a collection as lines of block style, one per entry."""
    if isinstance(value, Mapping):
        return [f"{text_of(str(key))}: {literal(one)}" for key, one in value.items()]
    return [f"- {literal(one)}" for one in value]
