"""Changes of a node tree at places of its data. What is new gets the position of what it stands for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from swarmctl.diagnostics import Edit, Span
from swarmctl.yamltext.compose import PLAIN, TEXT, Pair, compose, span_of
from swarmctl.yamltext.emit import literal
from swarmctl.yamltext.limits import MAX_DEPTH, LoadBudget
from swarmctl.yamltext.source import Loc

KEPT = object()
REMOVED = object()


@dataclass(frozen=True)
class Change:
    """Another value (data or a node) or key at ``loc``. A key that is not there yet is added."""

    loc: Loc
    value: Any = KEPT
    key: str | None = None


def changed(root: yaml.Node, changes: Iterable[Change]) -> tuple[yaml.Node, tuple[Span, ...]]:
    """Returns the tree with ``changes``, and the places that they changed.

    A change within another one is left out.
    """
    tree: dict[Any, Any] = {}
    for change in sorted(changes, key=lambda one: len(one.loc)):
        at: Any = tree
        for step in change.loc:
            if isinstance(at, Change):
                break
            held, at = at, at.setdefault(step, {})
        else:
            if not at and change.loc:
                held[change.loc[-1]] = change
    places: list[Span] = []
    return _with(root, tree, places), tuple(places)


def _with(node: yaml.Node, changes: Mapping[Any, Any], places: list[Span]) -> yaml.Node:
    if not changes or not isinstance(node, yaml.CollectionNode):
        return node
    made: list[Any] = []
    if isinstance(node, yaml.SequenceNode):
        for number, item in enumerate(node.value):
            made += [value for _, value in _pair((item, item), changes.get(number), places)]
    else:
        open_changes = dict(changes)
        for pair in node.value:
            name = pair[0].value if isinstance(pair[0], yaml.ScalarNode) else None
            made += _pair(pair, open_changes.pop(name, None), places)
        made += [
            _added(node, key, one.value, places)
            for key, one in open_changes.items()
            if isinstance(one, Change) and one.value not in (KEPT, REMOVED)
        ]
    return type(node)(node.tag, made, node.start_mark, node.end_mark, flow_style=node.flow_style)


def _pair(pair: Pair, change: Any, places: list[Span]) -> list[Pair]:
    key, value = pair
    if not isinstance(change, Change):
        return [(key, _with(value, change or {}, places))]
    if change.value is REMOVED:
        places += (span_of(key), span_of(value))
        return []
    if change.value is not KEPT:
        places.append(span_of(value))
        value = _node(change.value, value.start_mark, value.end_mark)
        if isinstance(value, yaml.MappingNode):  # what it lacks is shown at its key
            places.append(span_of(key))
    if change.key is not None:
        places.append(span_of(key))
        key = _node(change.key, key.start_mark, key.end_mark)
    return [(key, value)]


def _added(node: yaml.Node, key: str, value: Any, places: list[Span]) -> Pair:
    """A pair without a text: it stands for an empty place where its mapping begins."""
    mark = node.start_mark
    made = _node(key, mark, mark), _node(value, mark, mark)
    places.append(span_of(made[0]))
    return made


def _node(value: Any, start: Any, end: Any) -> yaml.Node:
    """Returns data as nodes, or a copy of a node, at one position."""
    if isinstance(value, yaml.ScalarNode):
        return yaml.ScalarNode(value.tag, value.value, start, end)
    if isinstance(value, yaml.MappingNode):
        pairs = [(_node(key, start, end), _node(one, start, end)) for key, one in value.value]
        return yaml.MappingNode(PLAIN, pairs, start, end, flow_style=True)
    if isinstance(value, Mapping):
        pairs = [(_node(key, start, end), _node(one, start, end)) for key, one in value.items()]
        return yaml.MappingNode(PLAIN, pairs, start, end, flow_style=True)
    if isinstance(value, (yaml.SequenceNode, list, tuple)):
        items = value.value if isinstance(value, yaml.SequenceNode) else value
        return yaml.SequenceNode(
            PLAIN, [_node(item, start, end) for item in items], start, end, flow_style=True
        )
    if isinstance(value, str):
        return yaml.ScalarNode(TEXT, value, start, end)
    return yaml.ScalarNode(PLAIN, literal(value), start, end)


def changes_of(root: yaml.Node, edits: Sequence[Edit], trees: Sequence[yaml.Node] = ()) -> tuple[Change, ...]:
    """Returns what ``edits`` of a text change in its tree; nothing if they are more than new words.

    What is only in one of the ``trees`` that the tree is made of is a word that another one replaces.
    """
    texts = {(one.span.file, one.span.line, one.span.column): one.text for one in edits}
    found: list[Change] = []
    words: set[tuple[str, int, int]] = set()

    def word(node: yaml.Node) -> str | None:
        mark = node.start_mark
        place = (mark.name, mark.line + 1, mark.column + 1)
        if place in texts:
            words.add(place)
        return texts.get(place)

    def search(node: yaml.Node, loc: Loc) -> None:
        if len(loc) > MAX_DEPTH or not isinstance(node, yaml.CollectionNode):
            return
        is_list = isinstance(node, yaml.SequenceNode)
        for number, entry in enumerate(node.value):
            key, value = (entry, entry) if is_list else entry
            if not is_list and not isinstance(key, yaml.ScalarNode):
                continue
            at = (*loc, number if is_list else key.value)
            if not is_list and (text := word(key)) is not None:
                found.append(Change(at, key=_read(text).value))
            if isinstance(value, yaml.ScalarNode) and (text := word(value)) is not None:
                found.append(Change(at, value=_read(text)))
            else:
                search(value, at)

    if any((one.span.line, one.span.column) == (one.span.end_line, one.span.end_column) for one in edits):
        return ()
    search(root, ())
    changes, used = tuple(found), len(words)
    for tree in trees if used < len(texts) else ():
        search(tree, ())
    return changes if len(changes) == used and len(words) == len(texts) else ()


def _read(text: str) -> yaml.Node:
    node, _ = compose(text, "", LoadBudget())
    return node or yaml.ScalarNode(PLAIN, "", None, None)
