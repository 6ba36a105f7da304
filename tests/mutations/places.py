"""The parts of one YAML file with their positions, read without swarmctl's own parser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import yaml

Loc = tuple[str | int, ...]


@dataclass(frozen=True)
class Place:
    """A key, value or entry: ``text[start:end]`` of its file, on ``line`` (from 1)."""

    loc: Loc
    start: int
    end: int
    line: int
    value: str | None  # of a scalar, without its quotes
    plain: bool  # a scalar without quotes
    flow: bool  # stands between brackets


@dataclass(frozen=True)
class File:
    """One file of a correct spec."""

    path: Path
    text: str

    @cached_property
    def _places(self) -> tuple[list[Place], list[Place]]:
        keys: list[Place] = []
        values: list[Place] = []
        root = yaml.compose(self.text, Loader=yaml.SafeLoader)
        if root is not None:
            self._walk(root, (), keys, values, flow=False)
        return keys, values

    def _walk(self, node: yaml.Node, loc: Loc, keys: list[Place], values: list[Place], *, flow: bool) -> None:
        values.append(_place(node, loc, flow, self.text))
        inside = isinstance(node, yaml.CollectionNode) and bool(node.flow_style)
        if isinstance(node, yaml.MappingNode):
            for key, value in node.value:
                keys.append(_place(key, (*loc, key.value), inside, self.text))
                self._walk(value, (*loc, key.value), keys, values, flow=inside)
        elif isinstance(node, yaml.SequenceNode):
            for index, item in enumerate(node.value):
                self._walk(item, (*loc, index), keys, values, flow=inside)

    def names(self, *patterns: str) -> Iterator[Place]:
        """Yields the keys at the places that fit one of the patterns; all without a pattern."""
        return (one for one in self._places[0] if not patterns or fits(one.loc, patterns))

    def values(self, *patterns: str) -> Iterator[Place]:
        """Yields the values at the places that fit one of the patterns; all without a pattern."""
        return (one for one in self._places[1] if not patterns or fits(one.loc, patterns))

    def scalars(self, *patterns: str) -> Iterator[Place]:
        """Yields the values that are no list and no mapping."""
        return (one for one in self.values(*patterns) if one.value is not None)

    def with_text(self, place: Place, text: str) -> str:
        """Returns the file's text with other text at ``place``."""
        return self.text[: place.start] + text + self.text[place.end :]

    def without(self, loc: Loc) -> str | None:
        """Returns the file's text without one entry of a list or mapping; None if it is the only one."""
        key = next((one for one in self._places[0] if one.loc == loc), None)
        value = next(one for one in self._places[1] if one.loc == loc)
        start, end = (key or value).start, value.end
        siblings = [
            one
            for one in self._places[1]
            if one.loc[:-1] == loc[:-1] and len(one.loc) == len(loc) and one.loc
        ]
        if len(siblings) < 2:
            return None
        if value.flow or (key is not None and key.flow):
            return _without_flow_entry(self.text, start, end)
        line_start = self.text.rfind("\n", 0, start) + 1
        line_end = self.text.find("\n", start + len(self.text[start:end].rstrip())) + 1
        return self.text[:line_start] + self.text[line_end or len(self.text) :]

    def line_of(self, word: str) -> list[int]:
        """Returns the lines on which ``word`` stands."""
        return [number for number, line in enumerate(self.text.splitlines(), 1) if word in line]


def _place(node: yaml.Node, loc: Loc, flow: bool, text: str) -> Place:
    scalar = isinstance(node, yaml.ScalarNode)
    start, end = node.start_mark.index, node.end_mark.index
    return Place(
        loc=loc,
        start=start,
        end=start + len(text[start:end].rstrip()),
        line=node.start_mark.line + 1,
        value=node.value if scalar else None,
        plain=scalar and node.style is None,
        flow=flow,
    )


def _without_flow_entry(text: str, start: int, end: int) -> str:
    after = text[end:].lstrip()
    if after.startswith(","):
        end = len(text) - len(after) + 1
        end += len(text[end:]) - len(text[end:].lstrip(" "))
    else:
        start = len(text[:start].rstrip().removesuffix(","))
    return text[:start] + text[end:]


def fits(loc: Loc, patterns: tuple[str, ...]) -> bool:
    """Returns True if one pattern is like ``loc``; `*` is any step."""
    steps = [pattern.split(".") for pattern in patterns]
    return any(
        len(one) == len(loc) and all(step in ("*", str(part)) for step, part in zip(one, loc, strict=True))
        for one in steps
    )
