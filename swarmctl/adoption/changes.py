"""What differs between a rendered file and the same file on a host, and edits of an overlay. Pure."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarmctl.render.bundle import File
from swarmctl.render.rendered_values import Key, equal, values_of
from swarmctl.spec.load import Document
from swarmctl.yamltext import edits
from swarmctl.yamltext.files import content
from swarmctl.yamltext.scalars import literal
from swarmctl.yamltext.source import Loc, Source, parse


class _Absent:
    """Stands for a value that is not there."""

    def __repr__(self) -> str:
        return "nothing"


ABSENT = _Absent()


@dataclass(frozen=True)
class EditedFile:
    """A file of a release that was edited on its host.

    ``path`` is that in the release, ``place`` that on the host for a block of a system file, else equal.
    ``text`` is None if the host did not send it; ``deployed`` is the digest of the content that was deployed,
    empty for a file that was added.
    """

    host: str
    path: str
    place: str
    text: str | None
    deployed: str


@dataclass(frozen=True)
class Change:
    """One value that was edited: its key in the file, or none for a line of a text."""

    host: str
    path: str
    key: Key
    old: Any
    new: Any

    @property
    def what(self) -> str:
        """The change as people read it."""
        name = ".".join(map(str, self.key))
        return f"{name + ': ' if name else ''}{_shown(self.old)} -> {_shown(self.new)}"


def changes(file: EditedFile, rendered: str) -> list[Change] | str:
    """Returns the values in which the edited text differs from the rendered one, or why that is not known."""
    edited = file.text or ""
    before, after = values_of(file.path, rendered), values_of(file.path, edited)
    if before is not None and after is None:
        return "it cannot be read any more"
    if before is None or after is None:
        return _lines(file, rendered, edited)
    return [
        Change(file.host, file.path, key, before.get(key, ABSENT), after.get(key, ABSENT))
        for key in dict.fromkeys((*before, *after))
        if not equal(before.get(key, ABSENT), after.get(key, ABSENT))
    ]


def _lines(file: EditedFile, rendered: str, edited: str) -> list[Change] | str:
    one, two = rendered.splitlines(), edited.splitlines()
    found: list[Change] = []
    for what, start, end, first, last in difflib.SequenceMatcher(
        None, one, two, autojunk=False
    ).get_opcodes():
        if what == "equal":
            continue
        if what != "replace" or end - start != last - first:
            return "lines were added or removed in a file that is made from the spec"
        pairs = zip(one[start:end], two[first:last], strict=True)
        found += [Change(file.host, file.path, (), old, new) for old, new in pairs]
    return found


def _shown(value: Any) -> str:
    text = repr(value) if isinstance(value, (str, _Absent)) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


_PACKAGES = "packages"


def beside(document: Document, file: File) -> str:
    """Returns the path of the file beside the spec whose content ``file`` has; empty if there is none."""
    folder = Path(document.source.path).parent
    name = Path(file.path).name
    paths = [path for path, found in document.files.content.items() if found == file.content]
    paths.sort(key=lambda path: Path(path).name != name)
    if paths:
        return str(folder / paths[0])
    head, _, rest = file.path.partition("/")
    package, _, inside = rest.partition("/")
    source = document.spec.packages.get(package)
    if head != _PACKAGES or source is None or source.all:
        return ""
    place = folder / source.folder / inside
    try:
        return str(place) if content(place) == file.content else ""
    except OSError:
        return ""


#: What identifies the entries of a list in an overlay (see `yamltext.overlay`).
_NAMES = {"links": ("robot", "name"), "control": ("by",)}


def overlaid(text: str, spec: Source, loc: Loc, value: Any) -> str:
    """Returns the text of an overlay with ``value`` at ``loc`` of ``spec``.

    Empty where an overlay cannot say it.
    """
    names = _NAMES.get(str(loc[0]), ())
    rest = loc[2:] if names else loc[1:]
    if any(isinstance(one, int) for one in rest):
        return ""  # lists are replaced as a whole
    if not names:
        return _put(text, loc, value)
    entry = spec.data[loc[0]][loc[1]]
    identity = next(((name, entry[name]) for name in names if isinstance(entry.get(name), str)), None)
    if identity is None or not rest:
        return ""
    overlay, _ = parse(text, "")
    entries = (overlay.data or {}).get(loc[0], ())
    there = next((n for n, one in enumerate(entries) if one.get(identity[0]) == identity[1]), None)
    if there is not None:
        return _put(text, (loc[0], there, *rest), value)
    for key in reversed(rest):
        value = {key: value}
    item = {identity[0]: identity[1], **value}
    if not entries:
        return _put(text, (loc[0],), [item])
    return _applied(text, edits.append_item(overlay, (loc[0],), item))


def _put(text: str, loc: Loc, value: Any) -> str:
    overlay, _ = parse(text, "")
    if overlay.data:
        return _applied(text, edits.put(overlay, loc, value))
    for key in reversed(loc[1:]):
        value = {key: value}
    lines = [f"  {key}: {literal(one)}" for key, one in value.items()] if isinstance(value, dict) else []
    lines = lines or [f"  - {literal(one)}" for one in value]
    return "\n".join([f"{text.rstrip()}\n{loc[0]}:" if text.strip() else f"{loc[0]}:", *lines, ""])


def _applied(text: str, made: edits.Edits) -> str:
    return edits.apply(text, made) if made else ""
