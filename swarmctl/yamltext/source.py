"""Builds plain data from a node tree and keeps the position of each key and value. Knows no robots."""

from __future__ import annotations

import gc
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import yaml

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.yamltext import scalars
from swarmctl.yamltext.compose import (
    DIRECTIONS,
    PLAIN,
    TEXT,
    TOO_DEEP,
    Pair,
    compose,
    pairs_of,
    removal_of,
    span_of,
    turned_text,
)
from swarmctl.yamltext.files import MAX_DEPTH, MAX_FINDINGS, MAX_REPEATED, LoadBudget
from swarmctl.yamltext.ranges import may_stand_in

Loc = Sequence[str | int]

_STR = "tag:yaml.org,2002:str"
# After these errors data is incomplete, and further checks would report false errors.
_INCOMPLETE = {"YAML003", "YAML004", "YAML005", "YAML008", "YAML013"}

_UNFINISHED = object()  # marks a list or mapping whose values are being built


@dataclass(frozen=True)
class Source:
    """Data and the tree with the position of every part, each node in its own file."""

    path: str
    data: Any
    root: yaml.Node | None = field(repr=False)
    texts: Mapping[str, str] = field(repr=False)  # by file, as the marks name them
    trees: Sequence[yaml.Node] = field(default=(), repr=False)  # that `root` is made of, if they are several
    _keys: dict[int, dict[str, Pair]] = field(default_factory=dict, repr=False, compare=False)

    def copies(self, node: yaml.Node) -> int:
        """Returns how many values a range makes of the text of ``node``; 1 outside of ranges."""
        return self._copies.get(_place_of(node), 1)

    @cached_property
    def _copies(self) -> Mapping[tuple[str, int, str], int]:
        counts: Counter[tuple[str, int, str]] = Counter()
        if self.root is not None and any(map(may_stand_in, self.texts.values())):
            seen: set[int] = set()
            waiting = [self.root]
            while waiting:
                node = waiting.pop()
                counts[_place_of(node)] += 1
                if isinstance(node, yaml.ScalarNode) or id(node) in seen:
                    continue
                seen.add(id(node))
                pairs = node.value if isinstance(node, yaml.MappingNode) else ((item,) for item in node.value)
                waiting += [one for pair in pairs for one in pair]
        return counts

    @cached_property
    def layers(self) -> tuple[Source, ...]:
        """What a spec and each file laid over it have by themselves, also what another one replaces."""
        return tuple(source_of(tree, self.path, self.texts)[0] for tree in self.trees)

    @property
    def text(self) -> str:
        """Text of the spec's first file."""
        return self.texts.get(self.path, "")

    def span(self, loc: Loc = (), *, key: bool = False) -> Span:
        """Returns the position of the value at ``loc``, or of its key.

        A part of ``loc`` that is not in the file is skipped: a missing key gives the position of its parent,
        or of the key in the overlay that removes it.
        """
        node, key_node = self.root, None
        for part in loc:
            found = self.child(node, part)
            if found is None:
                if (removal := removal_of(node, part)) is not None:
                    return span_of(removal[0])
                continue
            key_node, node = found
        chosen = key_node if key and key_node is not None else node
        if chosen is None:
            return Span(self.path, 1, 1, 1, 1)
        if (
            not key
            and isinstance(chosen, yaml.CollectionNode)
            and not chosen.flow_style
            and key_node is not None
        ):
            chosen = key_node  # a block may span many lines; its key is one word
        return span_of(chosen)

    def child(self, node: yaml.Node | None, part: str | int) -> Pair | None:
        """Returns the key and value nodes below ``node`` at ``part``; an item of a list is its own key."""
        if isinstance(node, yaml.MappingNode):
            if id(node) not in self._keys:
                self._keys[id(node)] = pairs_of(node)
            return self._keys[id(node)].get(str(part))
        if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and 0 <= part < len(node.value):
            return node.value[part], node.value[part]
        return None


def _place_of(node: yaml.Node) -> tuple[str, int, str]:
    return node.start_mark.name, node.start_mark.index, type(node).__name__


def parse(text: str, path: str, budget: LoadBudget | None = None) -> tuple[Source, list[Diagnostic]]:
    """Parses one document of one file; the second value are its errors and warnings.

    ``budget`` is what other files of the same spec have left.
    """
    with collector_paused():
        root, problem = compose(text, path, budget or LoadBudget())
        source, found = source_of(root, path, {path: text})
        return source, [*([problem] if problem else []), *found]


def source_of(
    root: yaml.Node | None, path: str, texts: Mapping[str, str], trees: Sequence[yaml.Node] = ()
) -> tuple[Source, list[Diagnostic]]:
    """Builds the data of a tree, made of ``trees``; no data after errors that leave it incomplete."""
    builder = _Builder()
    data = None if root is None else builder.build(root)
    if any(found.code in _INCOMPLETE for found in builder.diagnostics):
        root, data = None, None
    return Source(path, data, root, texts, trees), builder.diagnostics


def _without_value(key: str, span: Span) -> Diagnostic:
    """YAML015: a key with nothing behind its colon, which a spec reads as if the key were not there."""
    help_ = "write a value, or remove the key"
    return Diagnostic("YAML015", f"`{key}` has no value", span, label="missing here", help=(help_,))


@contextmanager
def collector_paused() -> Iterator[None]:
    """Pauses the cyclic garbage collector, which would traverse a large tree again and again.

    Afterwards the tree is frozen: it holds no cycles, and traversing it takes longer than any rule.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.freeze()
            gc.enable()


class _Builder:
    """Converts nodes to dicts, tuples and scalars; collects what YAML allows and a spec does not.

    Keys and plain text are interned: a dict finds the name of a robot by identity, in a third of the time.
    """

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._done: dict[int, Any] = {}  # built lists and mappings by the id of their node
        self._sizes: dict[int, int] = {}  # of aliased lists and mappings, by their own id
        self._repeated = 0  # values that aliases added so far

    def build(self, node: yaml.Node, depth: int = 0) -> Any:
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        if id(node) in self._done:
            return self._again(node)
        if depth >= MAX_DEPTH:
            self._report("YAML004", TOO_DEEP, node)
            return None
        if node.tag != PLAIN and self._below_limit:
            self._refuse_tag(node)
        self._done[id(node)] = _UNFINISHED
        built: Any = (
            self._mapping(node, depth + 1)
            if isinstance(node, yaml.MappingNode)
            else tuple([self.build(item, depth + 1) for item in node.value])
        )
        self._done[id(node)] = built
        return built

    def _again(self, node: yaml.Node) -> Any:
        """Returns the value of an alias, within the limit on aliases of aliases."""
        built = self._done[id(node)]
        if built is _UNFINISHED:
            self._report("YAML005", "an alias may not contain itself", node)
            return None
        self._repeated += self._size(built)
        if self._repeated <= MAX_REPEATED:
            return built
        if not any(found.code == "YAML008" for found in self.diagnostics):
            self._report(
                "YAML008",
                f"aliases of this repeat more than {MAX_REPEATED} values",
                node,
                help=("write out what differs, and put shared values under `defaults`",),
            )
        return None

    def _size(self, built: Any) -> int:
        """Counts values; those behind aliases count each time."""
        if not isinstance(built, (dict, tuple)):
            return 1
        if id(built) not in self._sizes:
            values = built.values() if isinstance(built, dict) else built
            self._sizes[id(built)] = 1 + sum(map(self._size, values))
        return self._sizes[id(built)]

    def _mapping(self, node: yaml.MappingNode, depth: int) -> dict[str, Any]:
        built: dict[str, Any] = {}
        places: dict[str, Pair] = {}  # made only for a duplicate key
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                if not self._below_limit:
                    continue
                self._report(
                    "YAML006", "a key must be plain text", key_node, help=("write it without brackets",)
                )
                continue
            key: str = sys.intern(key_node.value)
            if key_node.tag != PLAIN:
                self._written_text(key_node)
            elif key == "<<":
                self._report(
                    "YAML003",
                    "merge keys (<<) are not part of a spec",
                    key_node,
                    help=("put shared values under `defaults`",),
                )
                continue
            if key in built:
                if not self._below_limit:
                    continue
                places = places or pairs_of(node)
                self._report(
                    "YAML002",
                    f"the key `{key}` is here twice",
                    key_node,
                    notes=(Note(span_of(places[key][0]), "first here"),),
                    help=("rename or remove one of them; YAML would silently keep the last",),
                )
                continue
            # saves a call for most values
            is_scalar = isinstance(value_node, yaml.ScalarNode)
            built[key] = value = self._scalar(value_node) if is_scalar else self.build(value_node, depth)
            if value is None and value_node.value == "" and self._below_limit:
                self.diagnostics.append(_without_value(key, span_of(value_node)))
        return built

    def _scalar(self, node: yaml.ScalarNode) -> Any:
        text: str = node.value
        if node.tag != PLAIN:
            return self._written_text(node)
        if text in scalars.WORDS:
            return scalars.WORDS[text]
        return sys.intern(text) if text[0] not in scalars.BEGINS_NUMBER else scalars.number_or_text(text)

    def _written_text(self, node: yaml.ScalarNode) -> str:
        """Returns a scalar that quotes or a tag declare as text."""
        text: str = node.value
        if node.tag not in (TEXT, _STR) and self._below_limit:
            self._refuse_tag(node)
        if not text.isprintable() and self._below_limit and (turning := DIRECTIONS.intersection(text)):
            self.diagnostics.append(turned_text(min(turning), span_of(node)))
        return text

    def _refuse_tag(self, node: yaml.Node) -> None:
        self._report(
            "YAML007",
            f"the tag `{node.tag}` is not supported",
            node,
            help=("remove it, or quote the text",),
        )

    def _report(
        self,
        code: str,
        message: str,
        node: yaml.Node,
        *,
        notes: tuple[Note, ...] = (),
        help: tuple[str, ...] = (),  # noqa: A002
    ) -> None:
        self.diagnostics.append(Diagnostic(code, message, span_of(node), notes=notes, help=help))

    @property
    def _below_limit(self) -> bool:
        """True below the limit of findings."""
        return len(self.diagnostics) < MAX_FINDINGS
