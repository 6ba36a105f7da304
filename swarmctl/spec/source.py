"""YAML text to plain data that remembers where each key and value stands.

One ``yaml.compose`` pass gives the node tree; scalars follow the YAML 1.2 core schema, so that an all-digit
Bluetooth address stays a string and ``no`` stays ``no``. Knows nothing of robots.
"""

from __future__ import annotations

import gc
import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import yaml

from swarmctl.spec.diagnostics import Diagnostic, Note, Span

Loc = Sequence[str | int]
Pair = tuple[yaml.Node, yaml.Node]

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INT = re.compile(r"[-+]?[0-9]{1,18}|0o[0-7]{1,20}|0x[0-9a-fA-F]{1,16}", re.ASCII)
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)
_WORDS: dict[str, Any] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
    ".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf, ".nan": math.nan,
}  # fmt: skip
_STANDARD_TAG = "tag:yaml.org,2002:"
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

_INCOMPLETE = (
    "YAML003",
    "YAML004",
    "YAML005",
    "YAML008",
)  # what is missing then would only bring false complaints

MAX_DEPTH = 64
MAX_REPEATED = 100_000  # values that aliases may add to those which stand in the text
_STACK_DEPTH = 2_000  # libyaml composes recursively and ends the process where the stack ends


@dataclass(frozen=True)
class Source:
    """One parsed file: its text, its data, and the node tree that says where everything stands."""

    path: str
    text: str
    data: Any
    root: yaml.Node | None = field(repr=False)
    _keys: dict[int, dict[str, Pair]] = field(default_factory=dict, repr=False, compare=False)

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
        return _span(self.path, chosen)

    def child(self, node: yaml.Node | None, part: str | int) -> Pair | None:
        """The key and the value below ``node`` at ``part``; for a list the item stands for its own key."""
        if isinstance(node, yaml.MappingNode):
            if id(node) not in self._keys:  # backwards, so that the first of two equal keys stays
                pairs = (
                    (key, value) for key, value in reversed(node.value) if isinstance(key, yaml.ScalarNode)
                )
                self._keys[id(node)] = {key.value: (key, value) for key, value in pairs}
            return self._keys[id(node)].get(str(part))
        if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and 0 <= part < len(node.value):
            return node.value[part], node.value[part]
        return None


def parse(text: str, path: str) -> tuple[Source, list[Diagnostic]]:
    """Parse one document. With errors, ``Source.data`` holds what could be read."""
    with collector_paused():
        return _parse(text, path)


def _parse(text: str, path: str) -> tuple[Source, list[Diagnostic]]:
    root, problem = _compose(text, path)
    if problem is not None:
        return Source(path, text, None, None), [problem]
    builder = _Builder(path)
    data = None if root is None else builder.build(root)
    if any(found.code in _INCOMPLETE for found in builder.diagnostics):
        return Source(path, text, None, None), builder.diagnostics
    return Source(path, text, data, root), builder.diagnostics


def _compose(text: str, path: str) -> tuple[yaml.Node | None, Diagnostic | None]:
    """The node tree of ``text``, or what keeps it from having one."""
    if (forbidden := _FORBIDDEN.search(text)) is not None:
        return None, _forbidden_character(text, forbidden.start(), path)
    try:
        if _may_be_deep(text) and (deep := _deep_place(text)) is not None:
            return None, Diagnostic("YAML004", _TOO_DEEP, _at(path, deep))
        return yaml.compose(text, Loader=_LOADER), None
    except yaml.MarkedYAMLError as error:
        return None, _syntax_error(error, text, path)


@contextmanager
def collector_paused() -> Iterator[None]:
    """For building large trees: else the cyclic collector walks over them again and again."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


_TOO_DEEP = f"this is nested more than {MAX_DEPTH} levels deep"


def _may_be_deep(text: str) -> bool:
    """A cheap upper bound: each level takes a bracket, or a column (a list may share its key's)."""
    longest = max(map(len, text.splitlines()), default=0)
    return text.count("[") + text.count("{") + 2 * longest > _STACK_DEPTH


def _deep_place(text: str) -> Any:
    """Where the nesting passes ``MAX_DEPTH``, without recursion."""
    depth = 0
    for event in yaml.parse(text, Loader=_LOADER):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                return event.start_mark
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
    return None


class _Builder:
    """Turns nodes into dicts, tuples and scalars; collects what YAML allows and a spec must not have."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.diagnostics: list[Diagnostic] = []
        self._done: dict[int, Any] = {}
        self._open: set[int] = set()
        self._built = 0  # values so far, those behind aliases counted each time
        self._sizes: dict[int, int] = {}
        self._repeated = 0

    def build(self, node: yaml.Node) -> Any:
        self._built += 1
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        if id(node) in self._done:
            return self._again(node)
        if id(node) in self._open:
            self._complain("YAML005", "an alias may not contain itself", node)
            return None
        if len(self._open) >= MAX_DEPTH:
            self._complain("YAML004", _TOO_DEEP, node)
            return None
        before = self._built
        self._open.add(id(node))
        built: Any = (
            self._mapping(node)
            if isinstance(node, yaml.MappingNode)
            else tuple(self.build(item) for item in node.value)
        )
        self._open.discard(id(node))
        self._done[id(node)] = built
        self._sizes[id(node)] = self._built - before
        return built

    def _again(self, node: yaml.Node) -> Any:
        """The value of a second mention, as long as mentions of mentions do not grow without end."""
        self._built += self._sizes[id(node)]
        self._repeated += self._sizes[id(node)]
        if self._repeated <= MAX_REPEATED:
            return self._done[id(node)]
        if not any(found.code == "YAML008" for found in self.diagnostics):
            self._complain(
                "YAML008",
                f"aliases of this repeat more than {MAX_REPEATED} values",
                node,
                help=("write out what differs, and put what several entries share under `defaults`",),
            )
        return None

    def _mapping(self, node: yaml.MappingNode) -> dict[str, Any]:
        built: dict[str, Any] = {}
        first: dict[str, yaml.Node] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                self._complain(
                    "YAML006", "a key must be a plain word", key_node, help=("write it without brackets",)
                )
                continue
            key = key_node.value
            if key == "<<" and not key_node.style:
                self._complain(
                    "YAML003",
                    "merge keys (<<) are not part of a spec",
                    key_node,
                    help=("put what several entries share under `defaults`",),
                )
                continue
            if key in first:
                self._complain(
                    "YAML002",
                    f"the key `{key}` stands here twice",
                    key_node,
                    notes=(Note(_span(self.path, first[key]), "first here"),),
                    help=("rename one of them or remove it; YAML would silently keep the last",),
                )
                continue
            first[key] = key_node
            built[key] = self.build(value_node)
        return built

    def _scalar(self, node: yaml.ScalarNode) -> Any:
        text: str = node.value
        if node.style in ("'", '"', "|", ">") or node.tag == "!":
            return text
        if node.tag and not node.tag.startswith(_STANDARD_TAG):
            self._complain(
                "YAML007",
                f"the tag `{node.tag}` means nothing here",
                node,
                help=("remove it, or quote the text",),
            )
            return text
        if text in _WORDS:
            return _WORDS[text]
        if _INT.fullmatch(text):
            return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
        if _FLOAT.fullmatch(text) and not text.lstrip("+-").isdigit():
            return float(text)
        return text

    def _complain(
        self,
        code: str,
        message: str,
        node: yaml.Node,
        *,
        notes: tuple[Note, ...] = (),
        help: tuple[str, ...] = (),  # noqa: A002
    ) -> None:
        self.diagnostics.append(Diagnostic(code, message, _span(self.path, node), notes=notes, help=help))


def _span(path: str, node: yaml.Node) -> Span:
    start, end = node.start_mark, node.end_mark
    return Span(path, start.line + 1, start.column + 1, end.line + 1, end.column + 1)


def _at(path: str, mark: yaml.Mark) -> Span:
    return Span(path, mark.line + 1, mark.column + 1, mark.line + 1, mark.column + 2)


# What libyaml says, what that means to the one who wrote the file, and how to mend it.
_TOLD = (
    ("expected ',' or '}'", "this bracket is not closed, or a comma is missing in it", "close it with `}`"),
    ("expected ',' or ']'", "this bracket is not closed, or a comma is missing in it", "close it with `]`"),
    (
        "unexpected end of stream",
        "this quote is not closed",
        "close it, or double it where it belongs to the text",
    ),
    (
        "mapping values are not allowed",
        "a second `:` cannot stand here",
        "indent the keys of one block alike; put text that holds a colon and a blank in quotes",
    ),
    ("expected key", "this line belongs to no block above it", "keys of one block start in the same column"),
    (
        "expected '-' indicator",
        "this is no entry of the list above it",
        "entries of one list start with `- ` in one column",
    ),
    ("could not find expected ':'", "this key has no colon", "write it like `name: lab`"),
    ("another document", "a second document begins here", "a spec is one document; remove the line `---`"),
    (
        "undefined alias",
        "this names an anchor that is nowhere set",
        "put text that starts with `*` in quotes",
    ),
    ("duplicate anchor", "this anchor is set twice", "give each anchor a name of its own"),
    (
        "unknown escape character",
        "this backslash escapes nothing",
        "use single quotes for text with backslashes",
    ),
)
_OPENED = (
    "expected ',' or",
    "unexpected end of stream",
)  # what was opened says more than where its end was missed


def _syntax_error(error: yaml.MarkedYAMLError, text: str, path: str) -> Diagnostic:
    mark, place = error.problem_mark or error.context_mark, error.context_mark
    problem = " ".join((error.problem or error.context or "it makes no sense").split())
    if mark is None:
        return Diagnostic("YAML001", f"this is not YAML: {problem}", Span(path, 1, 1, 1, 1))
    message, mend = f"this is not YAML: {problem}", ""
    for words, told, help_ in _TOLD:
        if words in problem:
            message, mend = told, help_
    if problem.startswith(("found character that cannot start", "found a tab")):
        message, mend = _odd_character(text, mark)
    notes: tuple[Note, ...] = ()
    if place is not None and place.line != mark.line and any(words in problem for words in _OPENED):
        if mark.index < len(text.rstrip()):
            notes = (Note(_at(path, mark), "the end was expected before this"),)
        mark = place
    elif place is not None and "anchor" in problem:
        notes = (Note(_at(path, place), "first here"),)
    return Diagnostic("YAML001", message, _at(path, mark), notes=notes, help=(mend,) if mend else ())


def _odd_character(text: str, mark: yaml.Mark) -> tuple[str, str]:
    char = text[mark.index : mark.index + 1]
    if char == "\t":
        return "a tab cannot indent YAML", "indent with spaces"
    return f"text cannot start with `{char}`", "put the text in quotes"


def _forbidden_character(text: str, index: int, path: str) -> Diagnostic:
    before = text[:index].splitlines() or [""]
    if text[:index].endswith(("\n", "\r")):
        before.append("")
    line, column = len(before), len(before[-1]) + 1
    return Diagnostic(
        "YAML001",
        f"the character U+{ord(text[index]):04X} cannot stand in YAML",
        Span(path, line, column, line, column + 1),
        help=("remove it; it may have come along with copied text",),
    )
