"""``include:`` of a spec: the trees of several files joined as if they were one, each node in its own place.

Nothing is said twice: two files may both have ``hosts``, and no host may stand in both; to change what
another file says is for overlays. Files outside the spec's own folder are not opened: a spec
from elsewhere has no business with them.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import yaml

from swarmctl.spec.diagnostics import Diagnostic, Note, Span
from swarmctl.spec.files import Read, content, text_of
from swarmctl.spec.limits import MAX_CHAIN, MAX_FINDINGS, Room
from swarmctl.spec.nodes import Pair, compose, is_null, pairs_of, span_of

KEY = "include"

Tree = tuple[yaml.Node | None, list[Diagnostic]]


def tree_of(text: str, path: Path, room: Room, read: Read = content) -> Tree:
    """The tree of a spec's text with all that it includes; with errors, what they leave of it."""
    including = _Including(path, room, read)
    return including.expanded(text, path), including.diagnostics


class _Including:
    """One spec while its files are joined."""

    def __init__(self, path: Path, room: Room, read: Read) -> None:
        self.room, self.read = room, read
        self.spec = path
        self.folder = os.path.realpath(path.parent)
        self.chain = [os.path.realpath(path)]
        self.places: dict[str, Span] = {}  # where each file is included
        self.diagnostics: list[Diagnostic] = []

    def expanded(self, text: str, path: Path) -> yaml.Node | None:
        root, problem = compose(text, str(path), self.room)
        if problem is not None:
            self.diagnostics.append(problem)
        if not isinstance(root, yaml.MappingNode) or KEY not in pairs_of(root):
            return root
        own = [pair for pair in root.value if pair[0].value != KEY]
        wishes = [value for key, value in root.value if key.value == KEY]
        parts = [part for wish in wishes for part in self._parts(wish, path)]
        return _mapping(root, joined([own, *parts]))

    def _parts(self, wish: yaml.Node, path: Path) -> Iterator[list[Pair]]:
        """The pairs of each file that one ``include`` names."""
        entries = wish.value if isinstance(wish, yaml.SequenceNode) else [wish]
        for entry in entries:
            if len(self.diagnostics) >= MAX_FINDINGS:
                return
            if not isinstance(entry, yaml.ScalarNode) or is_null(entry):
                self._complain("INC001", "`include` takes the name of a file, or a list of them", entry,
                               help="write it like: include: [hosts.yaml, robots/lab.yaml]")  # fmt: skip
            elif (found := self._included(entry, path.parent / entry.value)) is not None:
                yield found

    def _included(self, entry: yaml.ScalarNode, path: Path) -> list[Pair] | None:
        """The pairs of one file; nothing where it cannot be had."""
        real = self._allowed(entry, path)
        if real is None:
            return None
        self.places[real] = span_of(entry)
        text = text_of(path, self.room, self.read)
        if isinstance(text, Diagnostic):
            place = text.span or span_of(entry)
            self.diagnostics.append(replace(text, span=place, notes=self._way_here()))
            return None
        before = len(self.diagnostics)
        self.chain.append(real)
        root = self.expanded(text, path)
        self.chain.pop()
        if isinstance(root, yaml.MappingNode):
            return list(root.value)
        if root is not None or len(self.diagnostics) == before:
            self._complain("INC005", f"`{path}` holds no part of a spec", entry,
                           help="what is included has keys of a spec, such as `hosts`")  # fmt: skip
        return None

    def _allowed(self, entry: yaml.ScalarNode, path: Path) -> str | None:
        """The real path of a file that may be read now."""
        name = entry.value
        if "\0" in name or not name:
            self._complain("INC001", "this is no name of a file", entry)
            return None
        real = os.path.realpath(path)
        if Path(name).is_absolute() or not Path(real).is_relative_to(self.folder):
            self._complain("INC002", f"`{name}` lies outside the spec's folder", entry,
                           help=f"copy it beside `{self.spec}`; files elsewhere are not read")  # fmt: skip
        elif real in self.chain:
            circle = [*self.chain[self.chain.index(real) :], real]
            shown = " includes ".join(f"`{os.path.relpath(one, self.folder)}`" for one in circle)
            self._complain("INC003", f"this goes in a circle: {shown}", entry)
        elif real in self.places:
            first = Note(self.places[real], "first here")
            self._complain("INC004", f"`{name}` is included twice", entry, first,
                           help="include it once, in the spec itself")  # fmt: skip
        elif len(self.chain) > MAX_CHAIN:
            self._complain("INC003", f"more than {MAX_CHAIN} files include each other in a row", entry,
                           help="include them side by side in the spec itself")  # fmt: skip
        elif _is_special(path):
            self._complain("INC001", f"`{name}` is a device or a pipe, not a file", entry)
        else:
            return real
        return None

    def _complain(
        self,
        code: str,
        message: str,
        entry: yaml.Node,
        *notes: Note,
        help: str = "",  # noqa: A002
    ) -> None:
        told = (help,) if help else ()
        notes = (*notes, *self._way_here())
        self.diagnostics.append(Diagnostic(code, message, span_of(entry), notes=notes, help=told))

    def _way_here(self) -> tuple[Note, ...]:
        """Where each of the files is included that lead to the present one."""
        return tuple(Note(self.places[file], "included here") for file in reversed(self.chain[1:]))


def joined(parts: list[list[Pair]]) -> list[Pair]:
    """The pairs of several top levels: mappings and lists of one key become one, one after the other.

    What stands in two of them otherwise stands in the result twice, for the one who makes data of it to tell.
    """
    pairs: list[Pair] = []
    places: dict[str, int] = {}
    for part in parts:
        own = {key.value for key, _ in part if isinstance(key, yaml.ScalarNode)}
        known = {name: place for name, place in places.items() if name in own}
        for key, value in part:
            place = known.pop(key.value, None) if isinstance(key, yaml.ScalarNode) else None
            if place is not None and (both := _both(pairs[place][1], value)) is not None:
                pairs[place] = (pairs[place][0], both)
                continue
            if isinstance(key, yaml.ScalarNode):
                places.setdefault(key.value, len(pairs))
            pairs.append((key, value))
    return pairs


def _both(one: yaml.Node, other: yaml.Node) -> yaml.Node | None:
    if isinstance(one, yaml.MappingNode) and isinstance(other, yaml.MappingNode):
        return _mapping(one, [*one.value, *other.value])
    if isinstance(one, yaml.SequenceNode) and isinstance(other, yaml.SequenceNode):
        items = [*one.value, *other.value]
        return yaml.SequenceNode(one.tag, items, one.start_mark, one.end_mark, one.flow_style)
    return None


def _mapping(like: yaml.MappingNode, pairs: list[Pair]) -> yaml.MappingNode:
    return yaml.MappingNode(like.tag, pairs, like.start_mark, like.end_mark, like.flow_style)


def _is_special(path: Path) -> bool:
    try:
        mode = path.stat().st_mode
    except OSError:
        return False  # reading it will say why
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)
