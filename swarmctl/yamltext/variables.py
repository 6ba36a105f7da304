"""Replaces variables, ``${name}``, in the values of a tree; knows no robots.

A value that is one variable gets the value with its type; within text the text is inserted. ``$${`` is a
literal ``${``. Other words in braces, such as ``${HOME}``, are a shell's and stay.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

import yaml

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.field_types import VARIABLE
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.compose import TEXT, Replaced, is_null, like, part_of, span_of
from swarmctl.yamltext.files import MAX_DEPTH, MAX_FINDINGS, MAX_NODES, MAX_REPEATED
from swarmctl.yamltext.ranges import height

KEY = "vars"

_USE = re.compile(rf"\$\$\{{|\$\{{({VARIABLE[1:-1]})\}}", re.ASCII)
_MOST = 2 * MAX_NODES  # values that are made, each with 16 characters
_LARGEST = 2 * (MAX_NODES + MAX_REPEATED)  # tree, with what ranges and aliases repeat
_SHOWN = 40  # characters of a value in a note
_MOST_NOTES = 3  # of a text with variables


def may_stand_in(text: str) -> bool:
    """True if a text may set variables; much cheaper than parsing it."""
    return KEY in text


def is_small_enough(root: yaml.Node) -> bool:
    """False for a tree that is too deep or repeats too much; building its data reports that."""
    return height(root, 0, {}) <= MAX_DEPTH and _size(root, {}) <= _LARGEST


def _size(node: yaml.Node, known: dict[int, int]) -> int:
    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in known:
        pairs = node.value if isinstance(node, yaml.MappingNode) else ((item,) for item in node.value)
        known[id(node)] = 1 + sum(_size(one, known) for pair in pairs for one in pair)
    return known[id(node)]


class VariableError(Exception):
    """What is wrong with a variable at a place of its use, or ``at`` another node."""

    def __init__(
        self,
        code: str,
        message: str,
        *help_lines: str,
        notes: Iterable[Note] = (),
        at: yaml.Node | None = None,
    ) -> None:
        super().__init__(message)
        self.code, self.help_lines, self.notes, self.at = code, help_lines, tuple(notes), at


class _AlreadyReportedError(Exception):
    """A value that is unknown; what is wrong is reported between two marks."""


@dataclass
class Scope:
    """The variables at one place: ``look`` returns the node of a value, or raises ``VariableError``."""

    look: Callable[[str], yaml.Node | None]
    names: Callable[[], Collection[str]]
    known: dict[str, yaml.Node] = field(default_factory=dict)  # values without variables


class Writer:
    """Replaces the variables of one tree, within a limit, and collects their errors."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._reported: set[Span] = set()
        self._circles: dict[frozenset[str], Any] = {}  # where each is reported
        self._uses: dict[int, bool] = {}  # of lists and mappings: whether a variable is in them
        self._left = _MOST

    def replaced(
        self, node: yaml.Node, scope: Scope, wanted: Callable[[str], bool] = lambda _: True
    ) -> yaml.Node:
        """Returns ``node`` with the variables in it replaced, in those of its keys that are ``wanted``."""
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, scope) if "${" in node.value else node
        if not self._has_uses(node):
            return node
        if isinstance(node, yaml.MappingNode):
            pairs = (
                (key, self.replaced(one, scope) if wanted(str(key.value)) else one) for key, one in node.value
            )
            return like(node, list(pairs))
        return like(node, [self.replaced(item, scope) for item in node.value])

    def _has_uses(self, node: yaml.Node) -> bool:
        if isinstance(node, yaml.ScalarNode):
            return "${" in node.value
        if id(node) not in self._uses:
            pairs = node.value if isinstance(node, yaml.MappingNode) else ((item,) for item in node.value)
            self._uses[id(node)] = any(self._has_uses(pair[-1]) for pair in pairs)
        return self._uses[id(node)]

    def _scalar(self, node: yaml.ScalarNode, scope: Scope) -> yaml.Node:
        values: dict[str, yaml.Node] = {}
        try:
            made = self._value(node, scope, (), values)
        except _AlreadyReportedError as error:  # nothing else is reported at that place
            return _at(node, node, {}, *error.args)
        if made is node:
            return node
        if isinstance(made, yaml.SequenceNode):
            items = [_at(one, node, values) for one in made.value]
            return yaml.SequenceNode(made.tag, items, node.start_mark, node.end_mark, flow_style=True)
        return _at(made, node, values)

    # Values

    def _value(
        self,
        node: yaml.ScalarNode,
        scope: Scope,
        path: tuple[str, ...],
        values: dict[str, yaml.Node] | None = None,
    ) -> yaml.Node:
        """Returns a scalar with its variables replaced; a list for a variable that is one."""
        uses = list(_USE.finditer(node.value))
        pieces, end = [], 0
        for use in uses:
            piece = "${"
            if use[1]:
                value = self._variable(node, use, scope, path, values)
                if use[0] == node.value:
                    return value
                if not isinstance(value, yaml.ScalarNode):
                    help_ = f"write `${{{use[1]}}}` as a value of its own, or make the variable text"
                    error = VariableError("VAR003", f"`{use[1]}` is a list, and this is text", help_)
                    self._fail(error, node, use)
                piece = value.value
            pieces += [node.value[end : use.start()], piece]
            end = use.end()
        text = "".join([*pieces, node.value[end:]])
        return yaml.ScalarNode(node.tag if text else TEXT, text) if uses else node

    def _variable(
        self,
        node: yaml.ScalarNode,
        use: re.Match[str],
        scope: Scope,
        path: tuple[str, ...],
        values: dict[str, yaml.Node] | None,
    ) -> yaml.Node:
        """Returns what one use of a variable means."""
        name: str = use[1]
        try:
            given = scope.look(name)
            if given is None:
                near = did_you_mean(name, scope.names(), "the variables are")
                shell = f"write `$${{{name}}}` for the shell's"
                raise VariableError("VAR001", f"there is no variable `{name}`", *near, shell)
            if name in path:
                self._circle([*path[path.index(name) :], name], given)
            if len(path) == MAX_DEPTH:
                deep = f"variables use each other more than {MAX_DEPTH} times here"
                raise VariableError("VAR002", deep, "write some of them out")
            if name not in scope.known:
                scope.known[name] = self._known(name, given, scope, (*path, name))
        except VariableError as error:
            self._fail(error, node, use)
        if values is not None:
            values[name] = given
        known = scope.known[name]
        texts = [known] if isinstance(known, yaml.ScalarNode) else known.value
        if self._left < 0 or not self._count(sum(1 + len(one.value) // 16 for one in texts), node):
            raise _AlreadyReportedError(node.start_mark, node.end_mark)
        return known

    def _known(self, name: str, given: yaml.Node, scope: Scope, path: tuple[str, ...]) -> yaml.Node:
        """Returns the value of a variable without variables in it."""
        items = given.value if isinstance(given, yaml.SequenceNode) else [given]
        made = []
        for item in items:
            one = self._value(item, scope, path) if isinstance(item, yaml.ScalarNode) else item
            if not isinstance(one, yaml.ScalarNode) and (one is item or item is not given):
                message = f"`{name}` is no text, number, true or false, or list of these"
                raise VariableError("VAR003", message, "write one of them", at=item)
            if one is given and is_null(given):
                raise VariableError("VAR003", f"`{name}` has no value", "write one, or remove it", at=given)
            made.append(one)
        return like(given, made) if isinstance(given, yaml.SequenceNode) else made[0]

    # Errors

    def _circle(self, names: list[str], given: yaml.Node) -> None:
        steps = frozenset(names)
        if steps not in self._circles:
            self._circles[steps] = given
        message = f"`{names[0]}` contains itself: {' -> '.join(names)}"
        raise VariableError("VAR002", message, "remove one of these steps", at=self._circles[steps])

    def _count(self, count: int, node: yaml.Node) -> bool:
        self._left -= count
        if self._left < 0:
            message = f"variables make more than {_MOST} values here"
            self._report(Diagnostic("RANGE003", message, span_of(node), help=("use them less",)))
        return self._left >= 0

    def _fail(self, error: VariableError, node: yaml.ScalarNode, use: re.Match[str]) -> NoReturn:
        """Reports an error and gives up the value."""
        if error.at is not None:
            start, end = error.at.start_mark, error.at.end_mark
        else:
            start, end = part_of(node, use.start(), use.end())
        place = span_of(yaml.ScalarNode(TEXT, "", start, end))
        self._report(Diagnostic(error.code, str(error), place, help=error.help_lines, notes=error.notes))
        raise _AlreadyReportedError(start, end)

    def _report(self, found: Diagnostic) -> None:
        if found.span not in self._reported and len(self.diagnostics) < MAX_FINDINGS:
            self.diagnostics.append(found)
            self._reported |= {found.span} if found.span else set()


def _at(
    made: yaml.Node, node: yaml.ScalarNode, values: Mapping[str, yaml.Node], *marks: yaml.Mark
) -> Replaced:
    start, end = marks or (node.start_mark, node.end_mark)
    one = Replaced(made.tag, made.value, start, end, style=node.style)
    one.values = values
    return one


def explained(found: Iterable[Diagnostic], root: yaml.Node | None) -> tuple[Diagnostic, ...]:
    """Returns findings about replaced values with a note where each of their variables is set."""
    places: dict[Span, dict[Span, Note]] = {}
    for one in _replaced_in(root):
        notes = places.setdefault(span_of(one), {})
        for name, value in one.values.items() if len(notes) < _MOST_NOTES else ():
            notes[span_of(value)] = Note(span_of(value), f"`{name}` is {_shown(value)} here")

    def explain(one: Diagnostic) -> Diagnostic:
        known = {note.span for note in one.notes}
        notes = places.get(one.span, {}) if one.span and not one.secret else {}
        return replace(one, notes=(*one.notes, *(note for span, note in notes.items() if span not in known)))

    return tuple(map(explain, found))


def _shown(value: yaml.Node) -> str:
    text = ", ".join(str(one.value) for one in value.value) if isinstance(value.value, list) else value.value
    text = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
    return f"[{text}]" if isinstance(value.value, list) else text or "empty"


def _replaced_in(root: yaml.Node | None) -> Iterator[Replaced]:
    waiting, seen = [root] if root is not None else [], set[int]()
    while waiting:
        node = waiting.pop()
        if isinstance(node, Replaced):
            yield node
        elif not isinstance(node, yaml.ScalarNode) and id(node) not in seen:
            seen.add(id(node))
            pairs = node.value if isinstance(node, yaml.MappingNode) else ((item,) for item in node.value)
            waiting += [pair[-1] for pair in pairs]
