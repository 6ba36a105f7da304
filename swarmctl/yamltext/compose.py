"""Composes YAML text into a tree of nodes with positions, or returns a syntax error in plain words."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from copy import copy
from typing import Any

import yaml

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.yamltext.files import MAX_DEPTH, MAX_FIXABLE, MAX_NODES, MAX_REPEATED, LoadBudget
from swarmctl.yamltext.scalars import first_invisible, named


def at(mark: yaml.Mark) -> Span:
    """Returns the span of the one character at a mark."""
    return Span(mark.name, mark.line + 1, mark.column + 1, mark.line + 1, mark.column + 2)


_NOT_CLOSED = ("this quote is not closed", "close it, or double it if it is part of the text")
_NO_COLON = ("this key has no colon", "write it like `name: lab`")

# A part of libyaml's message, our message, and our help.
_MESSAGES = (
    (
        "expected ',' or '}'",
        "this bracket is not closed, or a comma is missing in it",
        "close it with `}`, or write the comma",
    ),
    (
        "expected ',' or ']'",
        "this bracket is not closed, or a comma is missing in it",
        "close it with `]`, or write the comma",
    ),
    ("unexpected end of stream", *_NOT_CLOSED),
    (
        "mapping values are not allowed",
        "a second `:` is not allowed here",
        "indent the keys of one block alike; put text with a colon and a space in quotes",
    ),
    (
        "expected key",
        "this line does not belong to any block above it",
        "keys of one block start in the same column",
    ),
    (
        "expected '-' indicator",
        "this is not an entry of the list above it",
        "entries of one list start with `- ` in one column",
    ),
    ("could not find expected ':'", *_NO_COLON),
    ("another document", "a second document begins here", "a spec is one document; remove the line `---`"),
    (
        "expected <document start>",
        "this line does not belong to what stands above it",
        "a spec is one document of lines like `name: lab`",
    ),
    (
        "expected alphabetic or numeric character",
        "a name is missing behind this sign",
        "put text that starts with `*` or `&` in quotes; a list names each entry",
    ),
    (
        "mapping keys are not allowed",
        "a value cannot be `?`",
        "write the value, or put it in quotes if it is text",
    ),
    (
        "undefined alias",
        "this alias has no anchor",
        "put text that starts with `*` in quotes",
    ),
    ("duplicate anchor", "this anchor is set twice", "give each anchor a different name"),
    (
        "unknown escape character",
        "this is not a valid escape",
        "use single quotes for text with backslashes",
    ),
)
_AFTER_SLIPS = ("mapping values are not allowed", "could not find expected ':'")
_OPENED = (
    "expected ',' or",
    "unexpected end of stream",
    "could not find expected ':'",
)  # where it was opened is more useful than where its end was expected

_WORD_END = re.compile(r"[^\s,{}\[\]\"']*[^\s,:{}\[\]\"']$")
# Lines that YAML takes for the beginning of text which the next line continues.
_SLIPS_OF_LINES = (
    (re.compile(r"[ \t]*(?:- +)?(?P<word>[A-Za-z0-9_-]+)[ \t]*"), *_NO_COLON),
    (
        re.compile(r"[ \t]*(?:- +)?(?P<word>[A-Za-z0-9_-]+:)[^\s:].*"),
        "a blank is missing behind this colon",
        "write it like `name: lab`",
    ),
    (
        re.compile(r"[ \t]*(?P<word>-)[A-Za-z].*"),
        "a blank is missing behind this dash",
        "begin an entry of a list with `- `",
    ),
    (
        re.compile("[ \t]*(?P<word>[\u2010-\u2015\u2212\u2022*]) .*"),
        "this is not the dash of a list",
        "begin an entry of a list with `- `, the hyphen of the keyboard",
    ),
)
_BRACKET = re.compile(
    r"(?:\[[0-9][0-9,*-]*\]|(?<=\$)\{[a-z][a-z0-9_]*\})(?:\$\{[a-z][a-z0-9_]*\}|[^\s,:{}\[\]])*"
)


def syntax_error(error: yaml.MarkedYAMLError, text: str, name: str) -> Diagnostic:
    """Returns YAML001 with the position and the fix of an error of libyaml."""
    mark, place = error.problem_mark or error.context_mark, error.context_mark
    problem = " ".join((error.problem or error.context or "invalid syntax").split())
    if mark is None:
        return Diagnostic("YAML001", f"this is not YAML: {problem}", Span(name, 1, 1, 1, 1))
    if word := _word_around(text, mark.index):
        what = "a range" if text[mark.index] == "[" else "a variable"
        return Diagnostic("YAML001", f"{what} needs quotes here", at(mark), help=(f'write "{word}"',))
    if opened := _quote_over_lines(text, mark):
        ends = Note(at(mark), "its text ends before this")
        return Diagnostic("YAML001", _NOT_CLOSED[0], opened, notes=(ends,), help=_NOT_CLOSED[1:])
    if any(words in problem for words in _AFTER_SLIPS) and (slip := _slip_in_line(text, mark, name)):
        return slip
    message, fix = f"this is not YAML: {problem}", ""
    for words, plain, help_ in _MESSAGES:
        if words in problem:
            message, fix = plain, help_
    if problem.startswith(("found character that cannot start", "found a tab")):
        message, fix = _odd_character(text, mark)
    notes: tuple[Note, ...] = ()
    if place is not None and place.line != mark.line and any(words in problem for words in _OPENED):
        if mark.index < len(text.rstrip()) and problem != "could not find expected ':'":
            notes = (Note(at(mark), "the end was expected before this"),)
        mark = place
    elif place is not None and "anchor" in problem:
        notes = (Note(at(place), "first here"),)
    advice = (fix,) if fix else ()
    if hidden := _invisible_near(text, mark):
        notes = (*notes, hidden)
        advice = ("YAML takes this character for a letter: write a blank, or remove it", *advice)
    return Diagnostic("YAML001", message, at(mark), notes=notes, help=advice)


def _invisible_near(text: str, mark: yaml.Mark) -> Note | None:
    """Returns the first invisible character of the line of an error, or of the line before it."""
    lines = re.split("\r\n|[\r\n]", text[: mark.index + 200])[: mark.line + 1]
    for number, line in list(enumerate(lines, 1))[-2:]:
        if (place := first_invisible(line)) is not None:
            span = Span(mark.name, number, place + 1, number, place + 2)
            return Note(span, f"the character {named(line[place])}")
    return None


def _quote_over_lines(text: str, mark: yaml.Mark) -> Span | None:
    """Returns where quoted text over several lines begins that ends just before ``mark``.

    A quote that is not closed takes in all lines up to the next quote.
    """
    if len(text) > MAX_FIXABLE:
        return None
    last: yaml.Token | None = None
    try:
        for token in yaml.scan(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
            if token.start_mark.index >= mark.index:
                break
            last = token if isinstance(token, yaml.ScalarToken) and token.style in ("'", '"') else last
    except yaml.YAMLError:
        pass  # the error that is being reported
    if last is None or last.end_mark.line == last.start_mark.line or mark.line > last.end_mark.line + 1:
        return None
    line, column = last.start_mark.line + 1, last.start_mark.column + 1
    return Span(mark.name, line, column, line, column + 1)


def _slip_in_line(text: str, mark: yaml.Mark, name: str) -> Diagnostic | None:
    """Returns what is wrong with the line before an error, where YAML took that line for text."""
    before = re.split("\r\n|[\r\n]", text[: mark.index])[: mark.line]
    while before and not before[-1].strip():
        before.pop()
    for form, message, help_ in _SLIPS_OF_LINES if before else ():
        if found := form.fullmatch(before[-1]):
            line, (start, end) = len(before), found.span("word")
            span = Span(name, line, start + 1, line, end + 1)
            return Diagnostic("YAML001", message, span, help=(help_,))
    return None


def _word_around(text: str, index: int) -> str:
    """Returns the word like ``pi-[1-5]`` or ``${net}.1`` that YAML splits at the bracket at ``index``."""
    start, end = max(0, index - 80), index + 80
    head, found = _WORD_END.search(text[start:index]), _BRACKET.match(text[start:end], index - start)
    return head[0] + found[0] if head and found else ""


def _odd_character(text: str, mark: yaml.Mark) -> tuple[str, str]:
    char = text[mark.index : mark.index + 1]
    if text.startswith("```", mark.index):
        return "three backticks are Markdown, not YAML", "remove the lines that begin with them"
    if char == "\t":
        return "a tab cannot indent YAML", "indent with spaces"
    return f"text cannot start with `{char}`", "put the text in quotes"


def forbidden_character(text: str, index: int, name: str) -> Diagnostic:
    """Returns the error for a character that YAML forbids, or that is unsafe to display."""
    before = text[:index].splitlines() or [""]
    if text[:index].endswith(("\n", "\r")):
        before.append("")
    line, column = len(before), len(before[-1]) + 1
    span = Span(name, line, column, line, column + 1)
    char = text[index]
    if char in DIRECTIONS:
        return turned_text(char, span)
    if char in "\x85\u2028\u2029":
        message = f"the character U+{ord(char):04X} ends a line for some programs and not for others"
        return Diagnostic("YAML001", message, span, help=("replace it with a plain line break",))
    return Diagnostic(
        "YAML001",
        f"the character U+{ord(char):04X} is not allowed in YAML",
        span,
        help=("remove it; it may come from copied text",),
    )


DIRECTIONS = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def turned_text(char: str, span: Span) -> Diagnostic:
    """YAML013: people would read something else than programs (Unicode UTS 55, CVE-2021-42574)."""
    return Diagnostic(
        "YAML013",
        f"the character U+{ord(char):04X} changes the direction of displayed text",
        span,
        label="people and programs read different text here",
        help=("remove it; right-to-left text needs none of these characters",),
    )


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


class Replaced(yaml.ScalarNode):
    """A scalar in the place of a text with variables. ``values``: what each of them is set to."""

    values: Mapping[str, yaml.Node]


def part_of(node: yaml.Node, start: int, end: int) -> tuple[yaml.Mark, yaml.Mark]:
    """Returns the position of some columns of a text; of the whole text if it is written otherwise."""
    first, last = node.start_mark, node.end_mark
    quoted = int(isinstance(node, yaml.ScalarNode) and node.style in ("'", '"'))
    as_read = last.column - first.column == len(node.value) + 2 * quoted and not isinstance(node, Replaced)
    if first.line != last.line or not as_read:
        return first, last
    return _moved(first, quoted + start), _moved(first, quoted + max(end, start + 1))


def _moved(mark: yaml.Mark, columns: int) -> yaml.Mark:
    return yaml.Mark(mark.name, mark.index + columns, mark.line, mark.column + columns, None, 0)


def like(node: Any, value: list[Any]) -> yaml.Node:
    """Returns a copy of a list or mapping with other content."""
    made: yaml.Node = copy(node)
    made.value = value
    return made


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
