"""Sections (top-level keys) of a spec of which nothing is known: to read one raises `UnreadError`.

Nothing of such a spec is ever deployed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any

import yaml

from swarmctl.diagnostics import Diagnostic
from swarmctl.rulebook import Severity
from swarmctl.spec.load import Document
from swarmctl.spec.model import Spec
from swarmctl.yamltext.compose import pairs_of
from swarmctl.yamltext.source import Source


class UnreadError(LookupError):
    """A section of which nothing is known is read."""


class _KnownSections(Spec):
    """A spec without some of its sections."""

    def __getattr__(self, name: str) -> Any:
        if name in Spec.model_fields:
            raise UnreadError(name)
        raise AttributeError(name)


def known_part(value: Mapping[str, Any]) -> Spec:
    """Returns a spec of some sections: to read another one raises `UnreadError`."""
    made = _KnownSections.__new__(_KnownSections)
    fields = {"__dict__": dict(value), "__pydantic_fields_set__": set(value)}
    for name, field in {**fields, "__pydantic_extra__": None, "__pydantic_private__": None}.items():
        object.__setattr__(made, name, field)
    return made


class Unread:
    """What is not known, since the sections that name it are not."""

    def __getattr__(self, name: str) -> Any:
        raise UnreadError(name)


def known_names(document: Document) -> dict[str, list[str]]:
    """Returns the names of a document by kind, without those that are not known."""
    found: dict[str, list[str]] = {}
    for kind in ("hosts", "robots", "programs", "islands", "types", "computers"):
        with suppress(UnreadError):
            found[kind] = list(getattr(document if kind in ("types", "computers") else document.spec, kind))
    return found


def sections_with(found: Iterable[Diagnostic], source: Source) -> set[str]:
    """Returns the sections in whose lines an error is; with an error elsewhere also those that are absent."""
    spans = {one.span for one in found if one.severity is Severity.ERROR}
    if not spans:
        return set()
    sections, wrong = _by_line(source.root), set[str]()
    for span in spans:
        there = sections.get((span.file, span.line), set()) if span is not None else set()
        wrong |= there
        if not there & set(Spec.model_fields):
            wrong |= Spec.model_fields.keys() - source.data.keys()
    return wrong


def _by_line(root: yaml.Node | None) -> Mapping[tuple[str, int], set[str]]:
    lines: dict[tuple[str, int], set[str]] = {}
    for name, pair in pairs_of(root).items() if isinstance(root, yaml.MappingNode) else ():
        for node in _below(pair):
            last = node.end_mark.line if isinstance(node, yaml.ScalarNode) else node.start_mark.line
            for line in range(node.start_mark.line, last + 1):
                lines.setdefault((node.start_mark.name, line + 1), set()).add(name)
    return lines


def _below(nodes: Iterable[yaml.Node]) -> Iterator[yaml.Node]:
    """The nodes and all that they hold, each once."""
    waiting, seen = list(nodes), set[int]()
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        yield node
        if isinstance(node, yaml.MappingNode):
            waiting += [one for pair in node.value for one in pair]
        elif isinstance(node, yaml.SequenceNode):
            waiting += node.value
