"""What differs between a rendered file and the same file as somebody edited it on a host. Pure."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import Any

from swarmctl.render.rendered_values import Key, equal, values_of


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
