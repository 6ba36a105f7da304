"""Changes of a spec's text at a place of its data: comments, order, quotes and layout stay as they are.

For the one who writes a rule: ``mend`` makes the ``fix`` of a diagnostic out of what these return,

    set_key(source, ("robots", "k3"), "host", "k3-pi")        a new key of a mapping (or its new value)
    append_item(source, ("links", 0, "hosts"), "k3-pi")       one more item of a list
    replace_value(source, ("hosts", "k3-pi", "port"), 22)     another value
    rename_key(source, ("hosts", "k3-pi", "adress"), "address")
    remove(source, ("links", 3))                              a key with its value, or an item
    as_text(source, ("links", 1, "usb", "serial"))            the same word in quotes

and ``mentions.rename`` changes a name with everything that mentions it. A change that the text does not allow
(what an alias repeats, or what was written once for several entries) is an empty tuple, and a fix with such a
part is no fix: ``mend`` then gives nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import yaml

from swarmctl.spec import rewrite
from swarmctl.spec.diagnostics import Edit, Fix, Span
from swarmctl.spec.layout import Kind, Layout, Part, layout, line_starts
from swarmctl.spec.limits import MAX_MENDED
from swarmctl.spec.literals import literal, text_of
from swarmctl.spec.source import Loc, Source

Edits = tuple[Edit, ...]

_QUOTES = ("'", '"')
_KINDS: dict[type[yaml.Node], Kind] = {
    yaml.ScalarNode: "scalar",
    yaml.MappingNode: "mapping",
    yaml.SequenceNode: "sequence",
}


def mend(title: str, *parts: Edits) -> Fix | None:
    """A fix of several changes; nothing if one of them cannot be made."""
    return Fix(title, tuple(edit for part in parts for edit in part)) if all(parts) else None


def replace_value(source: Source, loc: Loc, value: Any) -> Edits:
    """Write ``value`` where another one stands."""
    found = _find(source, loc)
    if found is None:
        return ()
    quote = found.part.style if found.part.style in _QUOTES else ""
    return found.edits(rewrite.replaced(found.layout, found.part, literal(value, quote)))


def as_text(source: Source, loc: Loc) -> Edits:
    """Put quotes around a word, so that it is text, letter by letter."""
    word = written(source, loc)
    return replace_value(source, loc, word) if word else ()


def written(source: Source, loc: Loc) -> str:
    """The letters of the word at ``loc``: ``0403`` where the data has a number."""
    found = _find(source, loc)
    return found.part.value if found and found.part.kind == "scalar" else ""


def rename_key(source: Source, loc: Loc, name: str) -> Edits:
    """Give the key of the value at ``loc`` another name."""
    found = _find(source, loc)
    key = found.holder.entries[found.number].key if found and found.holder else None
    if found is None or key is None:
        return ()
    return found.edits(((key.start, key.end, text_of(name, key.style)),))


def set_key(source: Source, loc: Loc, key: str, value: Any, *, after: str = "") -> Edits:
    """Give the mapping at ``loc`` a key: behind the key ``after`` if it has that, else behind its last."""
    found = _find(source, loc)
    if found is None:
        return ()
    if source.child(found.node, key) is not None:
        return replace_value(source, (*loc, key), value)
    if found.part.empty:
        return replace_value(source, loc, {key: value})
    keys = [entry.key for entry in found.part.entries if entry.key and not entry.explicit]
    names = [one.value for one in keys]
    if found.part.kind != "mapping" or len(keys) < len(found.part.entries):
        return ()
    quote = keys[-1].style if keys else ""
    if not loc and not found.part.flow and value and isinstance(value, (Mapping, list, tuple)):
        return found.edits(
            rewrite.inserted_block(found.layout, found.part, text_of(key, quote), _lines_of(value))
        )
    place = names.index(after) if after in names else -1
    written = f"{text_of(key, quote)}: {literal(value, quote if found.part.flow else '')}"  # JSON stays JSON
    return found.edits(rewrite.inserted(found.layout, found.part, written, place))


def append_item(source: Source, loc: Loc, value: Any) -> Edits:
    """Put one more item at the end of the list at ``loc``."""
    found = _find(source, loc)
    if found is None:
        return ()
    if found.part.empty:
        return replace_value(source, loc, [value])
    if found.part.kind != "sequence":
        return ()
    last = found.part.entries[-1].value.style if found.part.entries else ""
    written = literal(value, last if last in _QUOTES else "")
    written = written if found.part.flow else f"- {written}"
    return found.edits(rewrite.inserted(found.layout, found.part, written))


def remove(source: Source, loc: Loc) -> Edits:
    """Take away a key with its value, or an item of a list, and what is noted on the same line."""
    found = _find(source, loc)
    if found is None or found.holder is None:
        return ()
    return found.edits(rewrite.removed(found.layout, found.holder, found.number))


def apply(text: str, edits: Iterable[Edit]) -> str:
    """``text`` with all ``edits`` made; their spans are those of ``text``. Overlapping ones are an error."""
    lines = line_starts(text)
    done, pieces = 0, []
    for edit in sorted(edits, key=lambda edit: edit.span):
        start = lines[edit.span.line - 1] + edit.span.column - 1
        if start < done:
            raise ValueError("two edits change the same text")
        pieces += [text[done:start], edit.text]
        done = lines[edit.span.end_line - 1] + edit.span.end_column - 1
    return "".join([*pieces, text[done:]])


class _Place(NamedTuple):
    """A value of a file, and the collection of that file that holds it as its entry of this number."""

    node: yaml.Node
    file: str
    layout: Layout
    part: Part
    holder: Part | None
    number: int

    def edits(self, strokes: rewrite.Strokes) -> Edits:
        return tuple(Edit(self._span(start, end), written) for start, end, written in strokes)

    def _span(self, start: int, end: int) -> Span:
        lines, first, last = self.layout.lines, self.layout.line(start), self.layout.line(end)
        return Span(self.file, first + 1, start - lines[first] + 1, last + 1, end - lines[last] + 1)


def _find(source: Source, loc: Loc) -> _Place | None:
    """What stands at ``loc``, if each step to it stands there only and means there what it says."""
    key, node = None, source.root
    place = _place(source, None, node)
    for step in loc:
        pair = source.child(node, step)
        if place is None or pair is None or _is_one_of_a_range(node, step):
            return None
        key, node = pair
        place = _place(source, key, node)
    return place


def _is_one_of_a_range(holder: yaml.Node | None, step: str | int) -> bool:
    """Whether an item of a list has neighbours that were written together with it, as a range."""
    if not isinstance(holder, yaml.SequenceNode) or not isinstance(step, int):
        return False
    around = [item.start_mark for item in holder.value[max(0, step - 1) : step + 2]]
    return len({(mark.name, mark.index) for mark in around}) < len(around)


def _place(source: Source, key: yaml.Node | None, node: yaml.Node | None) -> _Place | None:
    if node is None:
        return None
    file = node.start_mark.name
    if any(len(source.texts[one.start_mark.name]) > MAX_MENDED for one in (key, node) if one is not None):
        return None
    found = layout(source.texts[file])
    kind = _KINDS[type(node)]
    part = found.parts.get((node.start_mark.index, kind))
    if part is None or part.anchor in found.aliased or (part.flow and found.text[part.start] not in "[{"):
        return None
    if kind == "scalar" and part.value != node.value:
        return None  # it was written once and stands for several
    if key is None:
        return _Place(node, file, found, part, None, 0)
    beside = layout(source.texts[key.start_mark.name])
    held = (beside.items if key is node else beside.keys).get(key.start_mark.index)
    if held is None:
        return None
    holder, number = held
    name = holder.entries[number].key
    if name is not None and name.value != key.value:
        return None
    return _Place(node, file, found, part, holder if beside is found else None, number)


def _lines_of(value: Any) -> list[str]:
    """A collection as lines of block style, one an entry."""
    if isinstance(value, Mapping):
        return [f"{text_of(str(key))}: {literal(one)}" for key, one in value.items()]
    return [f"- {literal(one)}" for one in value]
