"""Gives a host, a robot, a program or a group of a spec another name, in all of its files. Pure.

What the text has for others too, such as one name of a range, is not changed: then nothing is.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import yaml
from pydantic import TypeAdapter, ValidationError

from swarmctl.diagnostics import Edit, Span
from swarmctl.field_types import KEY, NAME, Name
from swarmctl.spec.load import Document
from swarmctl.spec.references import NewNames, at, kinds_meant, kinds_named_at, reworded
from swarmctl.suggest import did_you_mean
from swarmctl.swarm.names import robot_namespace
from swarmctl.text_patterns import words_of
from swarmctl.yamltext import edits
from swarmctl.yamltext.compose import Replaced
from swarmctl.yamltext.ranges import FREE
from swarmctl.yamltext.source import Loc, Source

KINDS = {"host": "hosts", "robot": "robots", "program": "programs", "group": "groups"}


class RenameError(ValueError):
    """A name that cannot be changed: the reason, and what helps."""


@dataclass(frozen=True)
class Renaming:
    """The new texts, by file, and the data that the spec has then."""

    kind: str  # of `KINDS`
    old: str
    new: str
    texts: Mapping[str, str]
    data: Any
    namespace: tuple[str, str] | None

    def check(self, document: Document, after: Document) -> None:
        """Raises ``RenameError`` if the spec means something else ``after`` its texts changed."""
        changed = next(_differences(self.data, after.source.data), None)
        if changed is not None:
            place = document.source.span(changed)
            raise RenameError(
                f"{place}: this would mean something else than with `{self.old}`",
                f"a glob, a range, a variable or another name decides it: write `{self.old}` there by itself",
            )

    def mentions(self, after: Document) -> list[Span]:
        """Returns where the files of the spec ``after`` still have the old name, or text that has it."""
        pattern = self._pattern()
        found = [one for file, text in after.source.texts.items() for one in _matches(pattern, file, text)]
        known = _known(after.source, pattern)
        return [one for one in found if (one.file, one.line, one.column) not in known]

    def mentions_in(self, file: str, content: bytes) -> list[Span]:
        """Returns where a file that is not changed has the old name."""
        try:
            return list(_matches(self._pattern(), file, content.decode()))
        except UnicodeDecodeError:
            return []

    def _pattern(self) -> re.Pattern[str]:
        words = {self.old, *(self.namespace or ("",))[:1]}
        names = "|".join(re.escape(one.strip("/")) for one in words if one)
        return re.compile(rf"(?<![\w-])(?:{names})(?![\w-]|\.\w)")  # no part of another name or of a file's


def rename(document: Document, old: str, new: str, kind: str | None = None) -> Renaming:
    """Returns how the texts change so that ``old`` is called ``new``. Raises ``RenameError``.

    ``kind``: of `KINDS`; needed if things of two kinds have the name.
    """
    kind = _kind(document, old, kind)
    _check(document, kind, old, new)
    source = document.source
    names = NewNames(_names(document, KINDS[kind], old, new), _namespaces(document, kind, old, new))
    final = dict(names.places(source.data, source.data))
    if any(isinstance(_node(source, loc), Replaced) for loc in final):
        names = replace(names, in_variables=True)
        final = dict(names.places(source.data, source.data))
    parts: list[edits.Edits] = []
    own = source.span((KINDS[kind], old), key=True)
    refused = [] if any(at(layer.data, (KINDS[kind], old)) for layer in source.layers or (source,)) else [own]
    for layer in source.layers or (source,):
        for loc, text in dict(names.places(layer.data, source.data)).items():
            made = reworded(layer, loc, text)
            parts.append(made)
            if not made:
                refused.append(layer.span(loc[:-1] if loc[-1] == KEY else loc, key=loc[-1] == KEY))
    whole = edits.joined(parts)
    refused += [edit.span for edit in whole if edit.copies > 1]
    if refused or not whole:
        first, *more = dict.fromkeys(map(str, refused or [own]))
        raise RenameError(
            f"{first}: `{old}` is not written there by itself, but as one of a range or by an alias",
            *(f"so it is in {one}" for one in more),
            f"write `{old}` out there, as an entry or an item of its own",
        )
    texts = {
        file: edits.apply(source.texts[file], _in(whole, file)) for file in {one.span.file for one in whole}
    }
    data = _changed(source.data, final)
    before, after = kinds_meant(source.data), kinds_meant(data)
    if turned := [loc for loc, one in before.items() if after[loc] != one]:
        raise RenameError(f"{source.span(turned[0])}: `{new}` would mean one of the {after[turned[0]]} there")
    return Renaming(kind, old, new, dict(sorted(texts.items())), data, names.namespace)


def _in(whole: Iterable[Edit], file: str) -> list[Edit]:
    return [one for one in whole if one.span.file == file]


def _sections(document: Document) -> Iterator[tuple[str, str]]:
    """Yields each kind with each name of it; a program for several hosts or robots has its own, too."""
    for kind, section in KINDS.items():
        for one in (document.source, *document.source.layers):
            yield from ((kind, name) for _, name in at(one.data, (section, KEY)))


def _kind(document: Document, old: str, kind: str | None) -> str:
    known = dict.fromkeys(_sections(document))
    kinds = [one for one, name in known if name == old and kind in (None, one)]
    if not kinds:
        names = dict.fromkeys(name for one, name in known if kind in (None, one))
        what = kind or "host, robot, program or group"
        raise RenameError(f"there is no {what} `{old}`", *did_you_mean(old, names, "there are"))
    if len(kinds) > 1:
        raise RenameError(
            f"`{old}` is a {' and a '.join(kinds)}",
            *(f"add `--kind {one}` to rename the {one}" for one in kinds),
        )
    return kinds[0]


def _check(document: Document, kind: str, old: str, new: str) -> None:
    try:
        TypeAdapter(Name).validate_python(new)
    except ValidationError:
        raise RenameError(f"`{new}` is not a name", words_of(NAME)) from None
    if (kind, new) in _sections(document):
        place = document.source.span((KINDS[kind], new), key=True)
        raise RenameError(f"there is a {kind} `{new}` already", f"it is in {place}")


def _names(document: Document, section: str, old: str, new: str) -> Mapping[str, Mapping[str, str]]:
    """The new names by section: of a program for several hosts or robots, also those of what it makes."""
    made = {section: {old: new}}
    written = {
        key
        for layer in document.source.layers
        for _, key in at(layer.data, ("programs", KEY))
        if any(at(layer.data, ("programs", key, listed)) for listed in ("hosts", "robots"))
    }
    for name, program in document.spec.programs.items():
        kind, owner = ("robots", program.robot) if program.robot else ("hosts", program.host or "")
        for key in written if (kind, owner) == (section, old) or section == "programs" else ():
            if name == f"{key}-{owner}" and (section != "programs" or key == old):
                parts = (new, owner) if section == "programs" else (key, new)
                made.setdefault("programs", {})[name] = "-".join(parts)
    return made


def _namespaces(document: Document, kind: str, old: str, new: str) -> tuple[str, str] | None:
    """The old and the new namespace of a robot, whose name it is."""
    if kind != "robot" or document.spec.robots[old].namespace:
        return None
    return robot_namespace(old, None), robot_namespace(new, None)


def _node(source: Source, loc: Loc) -> yaml.Node | None:
    node = source.root
    for part in loc:
        found = source.child(node, part)
        node = found[1] if found else node
    return node


def _changed(data: Any, places: Mapping[Loc, str], loc: tuple[str | int, ...] = ()) -> Any:
    """The data with other texts and keys at ``places``."""
    if isinstance(data, dict):
        return {
            places.get((*loc, key, KEY), key): _changed(one, places, (*loc, key)) for key, one in data.items()
        }
    if isinstance(data, tuple):
        return tuple(_changed(one, places, (*loc, number)) for number, one in enumerate(data))
    return places.get(loc, data)


def _differences(one: Any, other: Any, loc: tuple[str | int, ...] = ()) -> Iterator[Loc]:
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for key in one:
            yield from _differences(one[key], other[key], (*loc, key))
    elif isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        for number in range(len(one)):
            yield from _differences(one[number], other[number], (*loc, number))
    elif one != other:
        yield loc


def _matches(pattern: re.Pattern[str], file: str, text: str) -> Iterator[Span]:
    for number, line in enumerate(text.split("\n"), 1):
        for found in pattern.finditer(line):
            yield Span(file, number, found.start() + 1, number, found.end() + 1)


def _known(source: Source, pattern: re.Pattern[str]) -> set[tuple[str, int, int]]:
    """The places of other things with the name: of another kind, or words such as `needs: [laptop]`."""
    found: set[tuple[str, int, int]] = set()
    for layer in source.layers or (source,):
        for loc, node in _scalars(layer.root, ()):
            free = loc[0] == "groups" or not FREE.isdisjoint(loc)
            named = loc[-1] == KEY or kinds_named_at(loc) or (pattern.fullmatch(node.value) and not free)
            if named and pattern.fullmatch(node.value):
                mark = node.start_mark
                found.add((mark.name, mark.line + 1, mark.column + 1 + (node.style in ("'", '"'))))
    return found


def _scalars(node: yaml.Node | None, loc: tuple[str | int, ...]) -> Iterator[tuple[Loc, yaml.ScalarNode]]:
    if isinstance(node, yaml.ScalarNode):
        yield loc, node
    elif isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield (*loc, key.value, KEY), key
            yield from _scalars(value, (*loc, key.value))
    elif isinstance(node, yaml.SequenceNode):
        for number, item in enumerate(node.value):
            yield from _scalars(item, (*loc, number))
