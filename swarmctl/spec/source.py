"""A tree of nodes to plain data that remembers where each key and value stands. Knows nothing of robots."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import yaml

from swarmctl.spec import scalars
from swarmctl.spec.diagnostics import Diagnostic, Note, Span
from swarmctl.spec.limits import MAX_DEPTH, MAX_FINDINGS, MAX_REPEATED, Room
from swarmctl.spec.nodes import PLAIN, TEXT, TOO_DEEP, Pair, compose, pairs_of, span_of
from swarmctl.spec.syntax import DIRECTIONS, turned_text

Loc = Sequence[str | int]

_STR = "tag:yaml.org,2002:str"
# What is missing then, or not what it seems to be, would only bring false complaints.
_INCOMPLETE = {"YAML003", "YAML004", "YAML005", "YAML008", "YAML013"}

_UNFINISHED = object()  # stands for a list or mapping while its own values are built
_ODD_KEYS = frozenset(word for word in scalars.SWITCHES if len(word) > 1)  # the vocabulary has the key `y`


@dataclass(frozen=True)
class Source:
    """Data, and the tree that says where everything stands, each node in its own file."""

    path: str
    data: Any
    root: yaml.Node | None = field(repr=False)
    texts: Mapping[str, str] = field(repr=False)  # by file, as the marks name them
    _keys: dict[int, dict[str, Pair]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def text(self) -> str:
        """The text of the spec's first file."""
        return self.texts.get(self.path, "")

    def span(self, loc: Loc = (), *, key: bool = False) -> Span:
        """Where the value at ``loc`` stands, or its key.

        A part of ``loc`` that is not in the file is skipped: a missing key points at its parent.
        """
        node, key_node = self.root, None
        for part in loc:
            found = self.child(node, part)
            if found is None:
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
            chosen = key_node  # a whole block is no place to look at; its key is
        return span_of(chosen)

    def child(self, node: yaml.Node | None, part: str | int) -> Pair | None:
        """The key and the value below ``node`` at ``part``; for a list the item stands for its own key."""
        if isinstance(node, yaml.MappingNode):
            if id(node) not in self._keys:
                self._keys[id(node)] = pairs_of(node)
            return self._keys[id(node)].get(str(part))
        if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and 0 <= part < len(node.value):
            return node.value[part], node.value[part]
        return None


def parse(text: str, path: str) -> tuple[Source, list[Diagnostic]]:
    """One document of one file."""
    with collector_paused():
        room = Room()
        root, problem = compose(text, path, room)
        source, found = source_of(root, path, room.texts)
        return source, [*([problem] if problem else []), *found]


def source_of(root: yaml.Node | None, path: str, texts: Mapping[str, str]) -> tuple[Source, list[Diagnostic]]:
    """The data of a tree; where too much of it is wrong, there is none."""
    builder = _Builder()
    data = None if root is None else builder.build(root)
    if any(found.code in _INCOMPLETE for found in builder.diagnostics):
        root, data = None, None
    return Source(path, data, root, texts), builder.diagnostics


@contextmanager
def collector_paused() -> Iterator[None]:
    """For building large trees: else the cyclic collector walks over them again and again.

    Nor need it look at them afterwards, which would take longer than any rule: they hold no cycles.
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
    """Turns nodes into dicts, tuples and scalars; collects what YAML allows and a spec must not have."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._done: dict[int, Any] = {}  # lists and mappings, by the id of their node
        self._sizes: dict[int, int] = {}  # of those that aliases name, by their own id
        self._repeated = 0  # values that aliases added so far

    def build(self, node: yaml.Node, depth: int = 0) -> Any:
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        if id(node) in self._done:
            return self._again(node)
        if depth >= MAX_DEPTH:
            self._complain("YAML004", TOO_DEEP, node)
            return None
        if node.tag != PLAIN and self._room:
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
        """The value of a second mention, as long as mentions of mentions do not grow without end."""
        built = self._done[id(node)]
        if built is _UNFINISHED:
            self._complain("YAML005", "an alias may not contain itself", node)
            return None
        self._repeated += self._size(built)
        if self._repeated <= MAX_REPEATED:
            return built
        if not any(found.code == "YAML008" for found in self.diagnostics):
            self._complain(
                "YAML008",
                f"aliases of this repeat more than {MAX_REPEATED} values",
                node,
                help=("write out what differs, and put what several entries share under `defaults`",),
            )
        return None

    def _size(self, built: Any) -> int:
        """How many values this is, those behind aliases counted each time."""
        if not isinstance(built, (dict, tuple)):
            return 1
        if id(built) not in self._sizes:
            values = built.values() if isinstance(built, dict) else built
            self._sizes[id(built)] = 1 + sum(map(self._size, values))
        return self._sizes[id(built)]

    def _mapping(self, node: yaml.MappingNode, depth: int) -> dict[str, Any]:
        built: dict[str, Any] = {}
        places: dict[str, Pair] = {}  # made only where a key is doubled
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                if not self._room:
                    continue
                self._complain(
                    "YAML006", "a key must be a plain word", key_node, help=("write it without brackets",)
                )
                continue
            key: str = key_node.value
            if key_node.tag != PLAIN:
                self._written_text(key_node)
            elif key == "<<":
                self._complain(
                    "YAML003",
                    "merge keys (<<) are not part of a spec",
                    key_node,
                    help=("put what several entries share under `defaults`",),
                )
                continue
            elif key in _ODD_KEYS:
                self._scalar(key_node)
            if key in built:
                if not self._room:
                    continue
                places = places or pairs_of(node)
                self._complain(
                    "YAML002",
                    f"the key `{key}` stands here twice",
                    key_node,
                    notes=(Note(span_of(places[key][0]), "first here"),),
                    help=("rename one of them or remove it; YAML would silently keep the last",),
                )
                continue
            # (a call less for most values)
            is_scalar = isinstance(value_node, yaml.ScalarNode)
            built[key] = self._scalar(value_node) if is_scalar else self.build(value_node, depth)
        return built

    def _scalar(self, node: yaml.ScalarNode) -> Any:
        text: str = node.value
        if node.tag != PLAIN:
            return self._written_text(node)
        if text in scalars.WORDS:
            return scalars.WORDS[text]
        if text[0] not in scalars.BEGINS_NUMBER and text not in scalars.SWITCHES:
            return text
        value = scalars.number_or_text(text)
        if self._room and (trap := scalars.trap(text, value)) is not None:
            self.diagnostics.append(scalars.warning(text, trap, span_of(node)))
        return value

    def _written_text(self, node: yaml.ScalarNode) -> str:
        """A scalar that is said to be text, by quotes or by a tag."""
        text: str = node.value
        if node.tag not in (TEXT, _STR) and self._room:
            self._refuse_tag(node)
        if not text.isprintable() and self._room and (turning := DIRECTIONS.intersection(text)):
            self.diagnostics.append(turned_text(min(turning), span_of(node)))
        return text

    def _refuse_tag(self, node: yaml.Node) -> None:
        self._complain(
            "YAML007",
            f"the tag `{node.tag}` means nothing here",
            node,
            help=("remove it, or quote the text",),
        )

    def _complain(
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
    def _room(self) -> bool:
        """Whether one more finding would be read."""
        return len(self.diagnostics) < MAX_FINDINGS
