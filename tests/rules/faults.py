"""Single faults for any spec: one word of its text, replaced by another one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import yaml

from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.limits import LoadBudget
from swarmctl.yamltext.source import Loc


@dataclass(frozen=True)
class Fault:
    """A word at ``loc``, in one line of a text, and what replaces it. Columns and lines count from 0."""

    loc: Loc
    line: int
    start: int
    end: int
    text: str


def faults_of(text: str) -> Iterator[Fault]:
    """Yields misspelt and unknown keys, misspelt and unknown values, and values of another kind or entry."""
    root, _ = compose(text, "swarm.yaml", LoadBudget())
    assert root is not None
    words = list(_words(root, ()))
    values: dict[str | int, list[str]] = defaultdict(list)
    for loc, node, is_key in words:
        if not is_key:
            values[_name(loc)].append(node.value)
    for loc, node, is_key in words:
        line, start, end = node.start_mark.line, node.start_mark.column, node.end_mark.column
        if line == node.end_mark.line:
            others = [one for one in values[_name(loc)] if one != node.value and ":" not in one]
            for wrong in _wrong(node.value, line, others[:1], is_key=is_key):
                yield Fault(loc, line, start, end, wrong)


def _wrong(value: str, line: int, others: Iterable[str], *, is_key: bool) -> Iterator[str]:
    if is_key:
        yield from (f"zzkk{line}", *([value[:2] + value[3:]] if len(value) > 3 else []))
        return
    yield from (f"zzvv{line}", '"Zz q!"', "[1, 2]", *others)
    if value.isdigit():
        yield str(int(value) * 9)
    elif len(value) > 3:
        yield value[:-2] + value[-1]


def _words(node: yaml.Node, loc: Loc) -> Iterator[tuple[Loc, yaml.ScalarNode, bool]]:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield (*loc, key.value), key, True
            yield from _words(value, (*loc, key.value))
    elif isinstance(node, yaml.SequenceNode):
        for place, item in enumerate(node.value):
            yield from _words(item, (*loc, place))
    elif isinstance(node, yaml.ScalarNode):
        yield loc, node, False


def _name(loc: Loc) -> str | int:
    """The last named step of a place."""
    return next((step for step in reversed(loc) if isinstance(step, str)), "")


def with_faults(text: str, faults: Iterable[Fault]) -> str:
    """Returns the text with faults in different lines; it keeps its number of lines."""
    lines = text.split("\n")
    for one in faults:
        lines[one.line] = lines[one.line][: one.start] + one.text + lines[one.line][one.end :]
    return "\n".join(lines)
