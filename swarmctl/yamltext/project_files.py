"""The one way from a spec to the files that it draws in, so that a foreign spec reads nothing else.

A file is part of a spec if it lies in the spec's folder, is not hidden and ends with ``.yaml``, and if all
of them together keep one budget. What links lead to counts, not what they are called.

Two files may both have ``hosts``, but no host may be in both: overlays change what another file has.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import yaml

from swarmctl.diagnostics import Diagnostic, Note, Span
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.compose import Pair, compose, is_null, pairs_of, span_of
from swarmctl.yamltext.files import (
    MAX_BYTES,
    MAX_CHAIN,
    MAX_ENTRIES,
    MAX_FILES,
    MAX_FINDINGS,
    LoadBudget,
    Read,
    content,
    is_special,
    is_stream,
)
from swarmctl.yamltext.scalars import legible

_USUAL = "swarm.yaml"  # of several files, the one that verbs take if none is named
SUFFIXES = (".yaml", ".yml")
OUTSIDE = "lies outside the spec's folder"
HIDDEN = "is hidden, or a link to a hidden file"
OTHER_SUFFIX = "does not end with `.yaml`, or is a link to such a file"


@dataclass(frozen=True)
class ProjectFiles:
    """The files in the folder of one spec, or of a file laid over it."""

    root: str | None  # the real path of the folder; None: nothing lies beside the spec
    budget: LoadBudget
    read: Read = content

    @classmethod
    def beside(cls, spec: Path, budget: LoadBudget, read: Read = content) -> ProjectFiles:
        """The files beside ``spec``; beside a pipe there are none."""
        return cls(None if is_stream(spec) else os.path.realpath(spec.parent), budget, read)

    def refusal(self, path: Path, suffixes: tuple[str, ...] = SUFFIXES) -> str:
        """Says why a file or folder is no part of the spec; empty if it is."""
        real = Path(os.path.realpath(path))
        if self.root is None or not real.is_relative_to(self.root):
            return OUTSIDE
        if any(part.startswith(".") for part in real.relative_to(self.root).parts):
            return HIDDEN
        is_part = real.name.endswith(suffixes) or os.path.isdir(real)  # noqa: PTH112  any length of a name
        return "" if is_part else OTHER_SUFFIX

    def named(self, path: Path) -> str | Diagnostic:
        """Returns the text of a file that the command line names: any file, but no link to another folder."""
        if path.is_symlink() and not is_stream(path) and self.refusal(path):
            return link_error(path, "name the file itself")
        return self._text(path)

    def text(self, path: Path, suffixes: tuple[str, ...] = SUFFIXES) -> str | Diagnostic:
        """Returns the text of a file beside the spec without its byte order mark, or the error."""
        if self.refusal(path, suffixes):
            return link_error(path)
        return self._text(path)

    def _text(self, path: Path) -> str | Diagnostic:
        budget = self.budget
        budget.files -= 1
        if budget.files < 0:
            return Diagnostic("FILE002", f"a spec has {MAX_FILES} files at most")
        try:
            found = self.read(path)
        except OSError as error:
            return _unreadable(path, error)
        budget.bytes -= len(found)
        if budget.bytes < 0:
            subject = f"`{path}` is" if len(found) > MAX_BYTES else f"`{path}` and the files before it are"
            return Diagnostic("FILE002", f"{subject} larger than {MAX_BYTES >> 20} MiB, the limit for a spec")
        try:
            return found.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            return _not_utf8(str(path), found, error.start)

    @property
    def exhausted(self) -> bool:
        """True if no file may be read any more."""
        return min(self.budget.files, self.budget.bytes, self.budget.nodes) < 0

    def names(self, folder: Path) -> list[str]:
        """Returns the names in a folder of the spec, sorted; hidden ones are left out."""
        if self.refusal(folder):
            return []
        try:
            with os.scandir(folder) as entries:
                return sorted(one.name for one in islice(entries, MAX_ENTRIES) if one.name[0] != ".")
        except OSError:
            return []


def link_error(
    path: Path, help_: str = "replace it by what it leads to; nothing elsewhere is read"
) -> Diagnostic:
    """The error about a link to what is no part of the spec."""
    return Diagnostic("FILE004", f"`{path}` is a link to what is no part of the spec", help=(help_,))


def _unreadable(path: Path, error: OSError) -> Diagnostic:
    if isinstance(error, IsADirectoryError):
        inside = sorted(path.glob("*.yaml"), key=lambda one: (one.name != _USUAL, one.name))
        help_ = (f"did you mean `{inside[0]}`?",) if inside else ("name the YAML file in it",)
        return Diagnostic("FILE001", f"`{path}` is a folder, not a spec", help=help_)
    if isinstance(error, FileNotFoundError):
        beside = [one.name for one in path.parent.glob("*.yaml") if one.name != path.name]  # it is a link
        near = did_you_mean(path.name, beside, "YAML files in that folder")
        return Diagnostic("FILE001", f"there is no file `{path}`", help=near)
    return Diagnostic("FILE001", f"cannot read `{path}`: {error.strerror or error}")


def _not_utf8(name: str, content: bytes, start: int) -> Diagnostic:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return Diagnostic(
            "FILE003", f"`{name}` is UTF-16", Span(name, 1, 1, 1, 1), help=("save the file as UTF-8",)
        )
    before = content[:start].decode("utf-8-sig").splitlines() or [""]
    if content[:start].endswith((b"\n", b"\r")):
        before.append("")
    line, column = len(before), len(before[-1]) + 1
    return Diagnostic(
        "FILE003",
        f"the byte 0x{content[start]:02X} is not valid UTF-8",
        Span(name, line, column, line, column + 1),
        help=("save the file as UTF-8",),
    )


KEY = "include"
_HELP = {
    OUTSIDE: "copy it beside `{spec}`; files elsewhere are not read",
    HIDDEN: "name it without a dot at the beginning; hidden files are not read",
    OTHER_SUFFIX: "rename the file to end with `.yaml`; others are not read",
}

Tree = tuple[yaml.Node | None, list[Diagnostic]]


def tree_of(text: str, path: Path, files: ProjectFiles) -> Tree:
    """Returns the tree of a spec with its included files, and the errors, after which it is partial."""
    including = _Including(path, files)
    return including.expanded(text, path), including.diagnostics


class _Including:
    """Joins the files of one spec."""

    def __init__(self, path: Path, files: ProjectFiles) -> None:
        self.spec, self.files = path, files
        self.chain = [os.path.realpath(path)]
        self.places: dict[str, Span] = {}  # where each file is included
        self.diagnostics: list[Diagnostic] = []

    def expanded(self, text: str, path: Path) -> yaml.Node | None:
        self.files.budget.texts[str(path)] = text
        root, problem = compose(text, str(path), self.files.budget)
        if problem is not None:
            self.diagnostics.append(problem)
        if not isinstance(root, yaml.MappingNode) or KEY not in pairs_of(root):
            return root
        own = [pair for pair in root.value if pair[0].value != KEY]
        includes = [value for key, value in root.value if key.value == KEY]
        parts = [part for include in includes for part in self._parts(include, path)]
        return _mapping(root, joined([own, *parts]))

    def _parts(self, include: yaml.Node, path: Path) -> Iterator[list[Pair]]:
        """Returns the pairs of each file that one ``include`` lists."""
        entries = include.value if isinstance(include, yaml.SequenceNode) else [include]
        for entry in entries:
            if len(self.diagnostics) >= MAX_FINDINGS:
                return
            if not isinstance(entry, yaml.ScalarNode) or is_null(entry):
                self._report("INC001", "`include` takes the name of a file, or a list of them", entry,
                               help="write it like: include: [hosts.yaml, robots/lab.yaml]")  # fmt: skip
            elif (found := self._included(entry, path.parent / entry.value)) is not None:
                yield found

    def _included(self, entry: yaml.ScalarNode, path: Path) -> list[Pair] | None:
        """Returns the pairs of one file; none if it cannot be read."""
        real = self._allowed(entry, path)
        if real is None:
            return None
        self.places[real] = span_of(entry)
        text = self.files.text(path)
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
            self._report("INC005", f"`{path}` is not part of a spec", entry,
                           help="an included file has keys of a spec, such as `hosts`")  # fmt: skip
        return None

    def _allowed(self, entry: yaml.ScalarNode, path: Path) -> str | None:
        """Returns the real path of a file that may be included here, or None after an error."""
        name = entry.value
        if "\0" in name or not name:
            self._report("INC001", "`include` has an empty name", entry,
                           help="write the name of a file, or remove the entry")  # fmt: skip
            return None
        real = os.path.realpath(path)
        if refusal := OUTSIDE if Path(name).is_absolute() else self.files.refusal(path):
            help_ = _HELP[refusal].format(spec=self.spec)
            self._report("INC002", f"`{name}` {refusal}", entry, help=help_)
        elif real in self.chain:
            circle = [*self.chain[self.chain.index(real) :], real]
            folder = os.path.realpath(self.spec.parent)
            shown = " includes ".join(f"`{os.path.relpath(one, folder)}`" for one in circle)
            self._report("INC003", f"files include each other in a circle: {shown}", entry)
        elif real in self.places:
            first = Note(self.places[real], "first here")
            self._report("INC004", f"`{name}` is included twice", entry, first,
                           help="include it once, in the spec itself")  # fmt: skip
        elif len(self.chain) > MAX_CHAIN:
            self._report("INC003", f"includes are nested more than {MAX_CHAIN} deep", entry,
                           help="include them side by side in the spec itself")  # fmt: skip
        elif is_special(path):
            self._report("INC001", f"`{name}` is a device or a pipe, not a file", entry)
        else:
            return real
        return None

    def _report(
        self,
        code: str,
        message: str,
        entry: yaml.Node,
        *notes: Note,
        help: str = "",  # noqa: A002
    ) -> None:
        lines = (help,) if help else ()
        notes = (*notes, *self._way_here())
        self.diagnostics.append(Diagnostic(code, legible(message), span_of(entry), notes=notes, help=lines))

    def _way_here(self) -> tuple[Note, ...]:
        """Returns the include entries that lead to the current file, as notes."""
        return tuple(Note(self.places[file], "included here") for file in reversed(self.chain[1:]))


def joined(parts: list[list[Pair]]) -> list[Pair]:
    """Joins the pairs of several top levels: mappings and lists under one key are concatenated.

    Other duplicate keys stay duplicate; building the data reports them.
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
