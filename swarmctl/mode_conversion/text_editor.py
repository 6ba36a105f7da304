"""Edits the text of a spec one change after the other, and keeps comments and layout."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from swarmctl.spec.load import source_of_text
from swarmctl.yamltext import edits
from swarmctl.yamltext.edits import Edits
from swarmctl.yamltext.source import Loc, Source

Change = tuple[str, Callable[[Source], Edits]]  # its title, and the edits that it takes


class TextEditor:
    """Edits the text of a spec, and parses it again after every change."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.done: list[str] = []
        self.undone: list[str] = []

    def change(self, *changes: Change) -> None:
        """Makes changes together, so that all elements of a range may change as one."""
        made = [make(self.source) for _, make in changes]
        whole = {replace(edit, copies=1) for edit in edits.joined(made) if edit.copies == 1}
        possible: list[Edits] = []
        for (title, _), part in zip(changes, made, strict=True):
            own = {replace(edit, copies=1) for edit in part}
            if own and own <= whole and {edit.span.file for edit in own} == {self.source.path}:
                possible.append(part)
                self.done.append(title)
            else:  # in a range of which the other elements do not change alike, or in another file
                self.undone.append(title)
        if possible:
            text = edits.apply(self.source.text, edits.joined(possible))
            self.source = source_of_text(text, self.source.path)

    def replace(self, loc: Loc, value: Any) -> None:
        """Replaces the value at ``loc``."""
        self.change(replaced(loc, value))

    def set(self, loc: Loc, key: str, value: Any, after: str = "") -> None:
        """Sets ``key`` of the mapping at ``loc``; a new key comes behind ``after``."""
        self.change(set_to(loc, key, value, after))

    def remove(self, loc: Loc) -> None:
        """Removes what is at ``loc``."""
        self.change(removed(loc))

    def rename(self, loc: Loc, key: str) -> None:
        """Gives the entry at ``loc`` another key."""
        self.change((f"{_path(loc)} renamed to {key}", lambda now: edits.rename_key(now, loc, key)))

    def append(self, loc: Loc, value: Any) -> None:
        """Adds an item to the list at ``loc``."""
        title = f"{_path(loc)}: {_shown(value)} added"
        self.change((title, lambda now: edits.append_item(now, loc, value)))


def replaced(loc: Loc, value: Any) -> Change:
    """Returns the change that replaces the value at ``loc``."""
    return f"{_path(loc)}: {_shown(value)}", lambda now: edits.replace_value(now, loc, value)


def set_to(loc: Loc, key: str, value: Any, after: str = "") -> Change:
    """Returns the change that sets ``key`` of the mapping at ``loc``."""
    title = f"{_path((*loc, key))}: {_shown(value)}"
    return title, lambda now: edits.set_key(now, loc, key, value, after=after)


def removed(loc: Loc) -> Change:
    """Returns the change that removes what is at ``loc``."""
    return f"{_path(loc)} removed", lambda now: edits.remove(now, loc)


def _path(loc: Loc) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).lstrip(".")


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_shown(one)}" for key, one in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_shown, value)) + "]"
    return str(value)
