"""Composes YAML text into a tree of nodes with positions, or returns a syntax error."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from typing import Any

import yaml

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.yamltext.limits import MAX_DEPTH, MAX_NODES, MAX_REPEATED, LoadBudget
from swarmctl.yamltext.syntax_errors import at, forbidden_character, syntax_error

Pair = tuple[yaml.Node, yaml.Node]

PLAIN = ""  # the tag of an unquoted scalar, and of a list or mapping, that has none
TEXT = "!"  # the tag of a quoted or block scalar that has none

# Characters that YAML forbids, that change the direction of displayed text (UTS 55), or that end a line for
# some programs only.
_FORBIDDEN = re.compile(
    "[^\t\n\r\x20-\x7e\xa0-\u2027\u202f-\u2065\u206a-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"
)


class TooMuchError(Exception):
    """The tree exceeds a limit below ``node``."""

    def __init__(self, code: str, message: str, node: yaml.Node | None) -> None:
        super().__init__(message)
        self.code, self.node = code, node


class _Stream(io.BytesIO):
    """A text with the file name that every mark of its tree gets, and the remaining budget."""

    def __init__(self, text: str, name: str, budget: LoadBudget) -> None:
        super().__init__(text.encode())
        self.name, self.budget = name, budget


_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Base):  # type: ignore[misc]
    """The composer, without the tags of YAML 1.1. It counts nodes and depth as it composes."""

    def __init__(self, stream: _Stream) -> None:
        super().__init__(stream)
        self.descend_resolver, self.ascend_resolver = _counting(stream.budget)

    def resolve(self, _: Any, text: str | None, implicit: Any) -> str:
        return PLAIN if text is None or implicit[0] else TEXT


def _counting(budget: LoadBudget) -> tuple[Callable[[yaml.Node | None, Any], None], Callable[[], None]]:
    """Returns the hooks that the composer calls before and after each node.

    A large spec has 200 000 nodes: attributes instead of these variables cost a fifth more time.
    """
    depth, left = 0, budget.nodes

    def before(parent: yaml.Node | None, _: Any) -> None:
        nonlocal depth, left
        depth += 1
        left -= 1
        if depth > MAX_DEPTH + 1:  # one more for the scalars in the deepest list
            raise TooMuchError("YAML004", TOO_DEEP, parent)
        if left < 0:
            budget.nodes = left
            raise TooMuchError("YAML014", f"there are more than {MAX_NODES} keys and values", parent)

    def after() -> None:
        nonlocal depth
        depth -= 1
        if not depth:
            budget.nodes = left

    return before, after


TOO_DEEP = f"this is nested more than {MAX_DEPTH} levels deep"


def compose(text: str, name: str, budget: LoadBudget) -> tuple[yaml.Node | None, Diagnostic | None]:
    """Composes one document within ``budget``; None for a document without content, or with an error."""
    if (forbidden := _FORBIDDEN.search(text)) is not None:
        return None, forbidden_character(text, forbidden.start(), name)
    if text.count("*") > MAX_REPEATED:
        return None, Diagnostic(
            "YAML008",
            f"there are more than {MAX_REPEATED} asterisks, which mark aliases",
            Span(name, 1, 1, 1, 1),
        )
    try:
        return yaml.compose(_Stream(text, name, budget), Loader=_Loader), None
    except yaml.MarkedYAMLError as error:
        return None, syntax_error(error, text, name)
    except TooMuchError as error:
        place = Span(name, 1, 1, 1, 1) if error.node is None else at(error.node.start_mark)
        return None, Diagnostic(error.code, str(error), place)


class OverlaidNode(yaml.MappingNode):
    """A mapping merged with an overlay. ``removed``: the pairs by which the overlay removes keys."""

    removed: Mapping[str, Pair]


def span_of(node: yaml.Node) -> Span:
    """Returns the position of a node in its own file."""
    start, end = node.start_mark, node.end_mark
    return Span(start.name, start.line + 1, start.column + 1, end.line + 1, end.column + 1)


def pairs_of(node: yaml.Node | None) -> dict[str, Pair]:
    """Returns the pairs of a mapping by key; of a duplicate key the first. Nothing else has any."""
    found = node.value if isinstance(node, yaml.MappingNode) else ()
    pairs = ((key, value) for key, value in reversed(found) if isinstance(key, yaml.ScalarNode))
    return {key.value: (key, value) for key, value in pairs}


def removal_of(node: yaml.Node | None, key: str | int) -> Pair | None:
    """Returns the pair by which an overlay removes ``key`` from a mapping; None if none does."""
    return node.removed.get(str(key)) if isinstance(node, OverlaidNode) else None


def is_plain(node: yaml.Node) -> bool:
    """True for an unquoted scalar without a tag."""
    return isinstance(node, yaml.ScalarNode) and node.tag == PLAIN


def is_null(node: yaml.Node) -> bool:
    """True for ``~``, ``null`` and a key without a value."""
    return is_plain(node) and node.value in ("", "~", "null", "Null", "NULL")
