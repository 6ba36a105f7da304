"""What can be checked of a spec with errors: the sections (top-level keys) in which no error is.

A rule that reads another section raises `UnsoundError`, and says nothing. Nothing of such a document is
ever deployed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import yaml
from pydantic import ValidationError, create_model

from swarmctl.diagnostics import Diagnostic, has_errors
from swarmctl.rulebook import Severity
from swarmctl.spec.load import Document, Draft
from swarmctl.spec.model import Spec
from swarmctl.yamltext.compose import pairs_of
from swarmctl.yamltext.source import Source, source_of


class UnsoundError(LookupError):
    """A section that is read has errors, or is missing."""


class _SoundSections(Spec):
    """A spec without some of its sections."""

    def __getattr__(self, name: str) -> Any:
        if name in Spec.model_fields:
            raise UnsoundError(name)
        raise AttributeError(name)


class _Unread:
    """What is not known, since the sections that name it are not sound."""

    def __getattr__(self, name: str) -> Any:
        raise UnsoundError(name)


def sound_document(draft: Draft, found: Iterable[Diagnostic]) -> Document | None:
    """Returns the document of the sections of a draft that are sound; None if nothing is certain.

    ``found`` are the findings in the draft and in its sections. The data is without sections in which the
    draft is wrong: which names they have is unknown.
    """
    source, odd = source_of(draft.root, draft.path, draft.texts, draft.trees)
    if not draft.is_complete or not isinstance(source.data, dict):
        return None
    wrong = sections_with(found, source) | ({"types"} if has_errors(draft.catalog.diagnostics) else set())
    fields: dict[str, Any] = {
        name: (field.annotation, field) for name, field in Spec.model_fields.items() if name not in wrong
    }
    part = create_model("Part", __config__=Spec.model_config, **fields)
    data = {name: value for name, value in source.data.items() if name in fields}
    try:
        values = dict(part.model_validate(data))
    except ValidationError:
        return None
    spec = _spec_of(values)
    unknown = sections_with([*draft.diagnostics, *odd], source)
    source = replace(source, data={name: one for name, one in source.data.items() if name not in unknown})
    try:
        return draft.document(spec, source, draft.catalog)
    except UnsoundError:
        unread: Any = _Unread()
        return Document(spec, source, draft.catalog, draft.private_keys, packages=unread, files=unread)


def without_sections(document: Document, wrong: Collection[str]) -> Document:
    """Returns the document without some sections."""
    kept = {name: value for name, value in document.spec.__dict__.items() if name not in wrong}
    return replace(document, spec=_spec_of(kept))


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


def _spec_of(values: Mapping[str, Any]) -> Spec:
    made = _SoundSections.__new__(_SoundSections)
    fields = {"__dict__": dict(values), "__pydantic_fields_set__": set(values)}
    for name, value in {**fields, "__pydantic_extra__": None, "__pydantic_private__": None}.items():
        object.__setattr__(made, name, value)
    return made
