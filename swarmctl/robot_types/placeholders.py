"""Placeholders such as `{namespace}` in the parameters and arguments of a ROS driver. Pure text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.field_types import Parameter
from swarmctl.links.link_base import RobotLink
from swarmctl.links.link_kinds import kinds

Loc = tuple[str | int, ...]

_OF_ANY_ROBOT = {
    "robot": "the robot's name",
    "namespace": "its ROS namespace, without the leading slash",
    "frame": "the prefix of its frames, without the slash behind it",
    "host": "the host of its driver",
    "address": "the address of that host",
}
_PART = re.compile(r"\{\{|\}\}|\{([^{}]*)\}|\{")
_BRACES = {"{{": "{", "}}": "}"}


class PlaceholderError(ValueError):
    """A placeholder without a value. ``name`` is what stands in braces."""

    def __init__(self, name: str, known: Mapping[str, object]) -> None:
        available = ", ".join(f"{{{one}}}" for one in known)
        super().__init__(f"`{{{name}}}` is not available; write one of {available}, or `{{{{` for a brace")
        self.name = name


def is_placeholder(name: str) -> bool:
    """Returns True for a placeholder of any robot, or of a kind of links."""
    return name in _OF_ANY_ROBOT or any(name in model.placeholders for _, model in kinds(RobotLink))


def meanings() -> Mapping[str, str]:
    """Returns every placeholder with its meaning; those of a kind of links need such a link."""
    forms: dict[str, str] = {}
    titles: dict[str, list[str]] = {}
    for _, model in kinds(RobotLink):
        for name, form in model.placeholders.items():
            forms.setdefault(name, form)
            titles.setdefault(name, []).append(model.title)
    last = {"uri": forms.pop("uri")}
    of_links = {name: form.format(_either(*titles[name])) for name, form in (forms | last).items()}
    return _OF_ANY_ROBOT | of_links


def _either(*words: str) -> str:
    return " or ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def texts_in(value: Parameter, *place: str | int) -> Iterator[tuple[Loc, str]]:
    """Yields each text of a value, list or mapping, behind its place below ``place``."""
    if isinstance(value, str):
        yield place, value
    elif isinstance(value, Mapping):
        for key, one in value.items():
            yield from texts_in(one, *place, key)
    elif isinstance(value, (list, tuple)):
        for index, one in enumerate(value):
            yield from texts_in(one, *place, index)


def placeholders_in(text: str) -> Iterator[str]:
    """Yields what stands in braces in a text."""
    for part in _PART.finditer(text):
        if part[0] not in _BRACES:
            yield part[1] or ""


def escaped(text: str) -> str:
    """Returns a text that ``filled`` turns back into ``text``."""
    return text.replace("{", "{{").replace("}", "}}")


def filled(value: Parameter, values: Mapping[str, str | int]) -> Any:
    """Returns ``value`` with the placeholders of its texts filled in, also of those in lists and mappings.

    Text that is one placeholder gets the type of what fills it. Raises PlaceholderError for one that
    is not in ``values``.
    """
    if isinstance(value, Mapping):
        return {key: filled(one, values) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [filled(one, values) for one in value]
    return _filled_text(value, values) if isinstance(value, str) else value


def _filled_text(text: str, values: Mapping[str, str | int]) -> str | int:
    for name in placeholders_in(text):
        if name not in values:
            raise PlaceholderError(name, values)
    whole = _PART.fullmatch(text)
    if whole is not None and whole[0] not in _BRACES:
        return values[whole[1]]
    return _PART.sub(lambda part: _BRACES.get(part[0]) or str(values[part[1]]), text)
