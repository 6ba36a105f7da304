"""Expands ranges: an entry for a range of names becomes one entry for each name.

A key that is a range, or an item of a list that holds one, becomes an entry for each element. Within such an
entry every range gives its k-th element to the k-th entry; so does ``{each: [...]}``. Marks do not change.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import yaml

from swarmctl.diagnostics import Diagnostic, Edit, Fix, Note, Span
from swarmctl.yamltext import hostlist
from swarmctl.yamltext.compose import span_of
from swarmctl.yamltext.files import MAX_DEPTH, MAX_FINDINGS, MAX_NODES
from swarmctl.yamltext.hostlist import Range

EACH = "each"

Pair = tuple[yaml.Node, yaml.Node]
Index = tuple[yaml.Node, Sequence[yaml.Node]]  # a range in an entry, and its elements

_BRACKET_IN_WORD = re.compile(r"\[(?<=[^\s\[{(,]\[)")
# Below these keys text is free.
FREE = frozenset({"types", "computers", "params", "args", "command", "environment", "reason", "vars"})


def may_stand_in(text: str) -> bool:
    """True if a text may hold ranges; much cheaper than parsing it."""
    return EACH in text or _BRACKET_IN_WORD.search(text) is not None


def expand(root: yaml.Node, others: Iterable[yaml.Node] = ()) -> tuple[yaml.Node, list[Diagnostic]]:
    """Returns the tree with its ranges expanded, and their errors; without ranges the same tree.

    The texts ``others`` have brackets of their own and stay.

    Where a range is wrong, the tree has something likely: the first element, or elements used again.
    """
    if height(root, 0, {}) > MAX_DEPTH:  # building the data reports it
        return root, []
    writer = _Writer(others)
    return writer.outside(root), writer.diagnostics


class _Writer:
    def __init__(self, others: Iterable[yaml.Node]) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._above: list[yaml.Node] = []  # the keys and items that lead to the current node
        self._done: dict[int, yaml.Node] = {}
        self._read: dict[int, Range | None] = {id(one): None for one in others}
        self._elements: dict[int, Sequence[yaml.Node]] = {}  # elements of each range in the current entry
        self._left = MAX_NODES

    # Outside of an entry with a range

    def outside(self, node: yaml.Node) -> yaml.Node:
        """Returns ``node`` with the ranges in it expanded."""
        if id(node) in self._done:
            return self._done[id(node)]
        made = node
        if isinstance(node, yaml.MappingNode):
            made = self._mapping(node)
        elif isinstance(node, yaml.SequenceNode):
            made = self._list(node)
        elif (found := self._range(node)) is not None:
            self._report_single(node, "this is a range where one value is needed")
            made = _copies(node, found)[0]
        self._done[id(node)] = made
        return made

    def _below(self, place: yaml.Node, node: yaml.Node) -> yaml.Node:
        self._above.append(place)
        made = self.outside(node)
        self._above.pop()
        return made

    def _mapping(self, node: yaml.MappingNode) -> yaml.Node:
        if (items := _items_of_each(node)) is not None:
            self._report_single(node, "`each` needs an entry with a range of names; this is one entry")
            return items[0] if items else node
        pairs: list[Pair] = []
        ranges: dict[int, Range] = {}  # by each key made from one
        for key, value in node.value:
            if _is_free(key) or (_is_plain(key) and _is_plain(value)):
                pairs.append((key, value))
            elif (found := self._range(key)) is None:
                reported = len(self.diagnostics)
                pairs.append((key, self._below(key, value)))
                if isinstance(key, yaml.ScalarNode) and "[" in key.value:  # no range, as is reported
                    del self.diagnostics[reported:]
            else:
                made = self._entries((key, value), (key, _copies(key, found)))
                pairs += [(one, below) for one, below in made]
                ranges |= {id(one): found for one, _ in made}
        if ranges:
            pairs = self._without_doubles(pairs, ranges)
        elif all(made is value for (_, made), (_, value) in zip(pairs, node.value, strict=True)):
            return node
        return _like(node, pairs)

    def _list(self, node: yaml.SequenceNode) -> yaml.Node:
        items: list[yaml.Node] = []
        for item in node.value:
            if (found := self._range(item)) is not None:
                items += _copies(item, found)
            elif isinstance(item, yaml.MappingNode) and (index := self._index(item, set())) is not None:
                items += [made for (made,) in self._entries((item,), index)]
            else:
                items.append(self._below(item, item))
        same = len(items) == len(node.value) and all(
            made is item for made, item in zip(items, node.value, strict=True)
        )
        return node if same else _like(node, items)

    def _index(self, item: yaml.MappingNode, seen: set[int]) -> Index | None:
        """Returns the range that multiplies an item of a list: the first outside of nested lists."""
        if id(item) in seen or _items_of_each(item) is not None:
            return None
        seen.add(id(item))
        for pair in item.value:
            for node in pair if not _is_free(pair[0]) else ():
                if _is_plain(node):
                    continue
                if (found := self._elements_of(node)) is not None:
                    return node, found
                if isinstance(node, yaml.MappingNode) and (index := self._index(node, seen)) is not None:
                    return index
        return None

    def _without_doubles(self, pairs: Sequence[Pair], ranges: dict[int, Range]) -> list[Pair]:
        """Drops pairs whose key a range repeats, and reports each pair of places once."""
        first: dict[str, yaml.Node] = {}
        doubled: dict[tuple[Span, Span], list[tuple[yaml.Node, yaml.Node]]] = {}
        kept: list[Pair] = []
        for key, value in pairs:
            before = first.setdefault(key.value, key) if isinstance(key, yaml.ScalarNode) else key
            if before is not key and (id(key) in ranges or id(before) in ranges):
                doubled.setdefault((span_of(before), span_of(key)), []).append((before, key))
            else:
                kept.append((key, value))  # building the data reports plain duplicates
        for (first_span, span), keys in doubled.items():
            before, key = keys[0]
            self._report(
                _doubled(
                    [one.value for _, one in keys],
                    first_span,
                    span,
                    ranges.get(id(key)) or ranges[id(before)],
                )
            )
        return kept

    # An entry with a range

    def _entries(self, parts: Sequence[yaml.Node], index: Index) -> list[list[yaml.Node]]:
        """Copies ``parts`` for each element of ``index``. Too short a range begins anew."""
        (origin, elements), seen = index, set[int]()
        self._elements = {id(origin): elements}
        for part in parts:
            for node, found in self._inside(part, seen):
                self._elements[id(node)] = found
                if len(found) != len(elements):
                    self._report(_unequal(node, found, origin, len(elements)))
        return [[self._copy(part, number) for part in parts] for number in range(len(elements))]

    def _inside(self, node: yaml.Node, seen: set[int], *, free: bool = False) -> Iterator[Index]:
        """Yields all ranges in an entry."""
        if (found := self._elements_of(node, free=free)) is not None:
            yield node, found
        elif id(node) in seen or isinstance(node, yaml.ScalarNode):
            return
        else:
            seen.add(id(node))
            for below in node.value:
                pair = below if isinstance(node, yaml.MappingNode) else (below,)
                for one in pair:
                    yield from self._inside(one, seen, free=free or (len(pair) == 2 and _is_free(pair[0])))

    def _copy(self, node: yaml.Node, number: int) -> yaml.Node:
        """Returns a part of an entry for one of its elements."""
        elements = self._elements.get(id(node))
        node = elements[number % len(elements)] if elements else node
        if isinstance(node, yaml.ScalarNode) or not self._count(1 + len(node.value), node):
            return node
        if isinstance(node, yaml.MappingNode):
            return _like(
                node, [(self._copy(key, number), self._copy(value, number)) for key, value in node.value]
            )
        assert isinstance(node, yaml.SequenceNode)
        return _like(node, [self._copy(item, number) for item in node.value])

    # Reading ranges

    def _elements_of(self, node: yaml.Node, *, free: bool = False) -> Sequence[yaml.Node] | None:
        """Returns the elements of a range or of ``each``, whose items may be ranges too; None for others."""
        if (items := _items_of_each(node)) is not None:
            ranges = [self._range(item) for item in items]
            return [
                made
                for item, found in zip(items, ranges, strict=True)
                for made in ([item] if found is None else _copies(item, found))
            ]
        found = self._range(node, free=free)
        return None if found is None else _copies(node, found)

    def _range(self, node: yaml.Node, *, free: bool = False) -> Range | None:
        """Parses a scalar as a range; reports other brackets unless text is ``free``."""
        if not isinstance(node, yaml.ScalarNode) or "[" not in node.value:
            return None
        if id(node) not in self._read:
            found = hostlist.read(node.value) if self._left >= 0 else None
            if isinstance(found, hostlist.NoRange) and not free:
                fix, place = _guessed(node, found.meant), span_of(node)
                self._report(Diagnostic(found.code, found.message, place, help=(found.help,), fix=fix))
                found = hostlist.read(found.meant)
            if isinstance(found, Range):
                self._count(len(found.numbers), node)
            self._read[id(node)] = found if isinstance(found, Range) else None
        return self._read[id(node)]

    def _count(self, count: int, node: yaml.Node) -> bool:
        if 0 <= self._left < count:
            message = f"ranges make more than {MAX_NODES} values here"
            self._report(Diagnostic("RANGE003", message, span_of(node), help=("make the ranges smaller",)))
        self._left -= count
        return self._left >= 0

    # Errors

    def _report_single(self, node: yaml.Node, message: str) -> None:
        entry = self._above[1] if len(self._above) > 2 else None
        notes: tuple[Note, ...] = ()
        help_ = "write one value here"
        if isinstance(entry, yaml.ScalarNode):
            notes = (Note(span_of(entry), f"`{entry.value}` is one entry"),)
            help_ = f"make its name a range as well, like `{entry.value}-[1-5]`, or write one value here"
        self._report(Diagnostic("RANGE006", message, span_of(node), notes=notes, help=(help_,)))

    def _report(self, found: Diagnostic) -> None:
        if len(self.diagnostics) < MAX_FINDINGS:
            self.diagnostics.append(found)


def _guessed(node: yaml.ScalarNode, meant: str) -> Fix | None:
    """The guess at what range is meant, if there is one."""
    place = span_of(node)
    if not meant or place is None or node.style in ("|", ">"):
        return None
    return Fix(f"write `{meant}`", (Edit(place, f'"{meant}"'),), safe=False)


def height(node: yaml.Node, above: int, known: dict[int, float]) -> float:
    """Returns how deep lists and mappings nest, ``above`` those around; infinite if an alias holds itself."""
    if isinstance(node, yaml.ScalarNode):
        return 0
    if above > MAX_DEPTH:
        return math.inf
    if id(node) not in known:
        known[id(node)] = math.inf
        pairs = node.value if isinstance(node, yaml.MappingNode) else ((item,) for item in node.value)
        heights = (height(one, above + 1, known) for pair in pairs for one in pair)
        known[id(node)] = 1 + max(heights, default=0)
    return known[id(node)]


def _items_of_each(node: yaml.Node) -> list[yaml.Node] | None:
    """Returns the items of ``{each: [...]}``; None for any other node."""
    if isinstance(node, yaml.MappingNode) and len(node.value) == 1:
        key, items = node.value[0]
        if isinstance(items, yaml.SequenceNode) and key.value == EACH:
            return list(items.value)
    return None


def _is_plain(node: yaml.Node) -> bool:
    """True for a scalar without a bracket, as nearly all are."""
    return isinstance(node, yaml.ScalarNode) and "[" not in node.value


def _is_free(key: yaml.Node) -> bool:
    return isinstance(key, yaml.ScalarNode) and key.value in FREE


def _copies(node: Any, found: Range) -> list[yaml.Node]:
    return [
        yaml.ScalarNode(node.tag, name, node.start_mark, node.end_mark, style=node.style)
        for name in found.names
    ]


def _like(node: yaml.CollectionNode, value: list[Any]) -> yaml.CollectionNode:
    """Returns a copy of a list or mapping with other content."""
    return type(node)(node.tag, value, node.start_mark, node.end_mark, flow_style=node.flow_style)


def _doubled(names: Sequence[str], first: Span, span: Span, found: Range) -> Diagnostic:
    several = len(names) > 1
    more, verb = (f" and {len(names) - 1} more", "are") if several else ("", "is")
    rest = found.without(names)
    return Diagnostic(
        "YAML002",
        f"the key `{names[0]}`{more} {verb} here twice",
        span,
        notes=() if first == span else (Note(first, "first here"),),
        help=(
            f"remove {'them' if several else 'it'} from the range: `{rest}`"
            if rest
            else "remove one of the two entries",
        ),
    )


def _unequal(node: yaml.Node, found: Sequence[yaml.Node], origin: yaml.Node, wanted: int) -> Diagnostic:
    written = hostlist.read(node.value) if isinstance(node, yaml.ScalarNode) else None
    times, rest = divmod(wanted, len(found)) if found else (0, 1)
    help_ = "give both the same length"
    if isinstance(written, Range) and rest == 0 and times > 1 and (repeated := written.repeated(times)):
        help_ += f"; to use each element {times} times, write `{repeated}`"
    return Diagnostic(
        "RANGE005",
        f"this has {_elements(len(found))}, and its entry has {wanted}",
        span_of(node),
        notes=(Note(span_of(origin), f"{_elements(wanted)} here"),),
        help=(help_,),
    )


def _elements(count: int) -> str:
    return f"{count} element" if count == 1 else f"{count} elements"
