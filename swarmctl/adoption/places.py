"""Where in a spec a rendered value may come from: guesses, the likely ones first. Pure.

Which guess is right shows when the changed spec is rendered. So a guess may be wrong, and need not know how
the value is derived.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import reduce
from itertools import islice
from operator import getitem
from typing import Any

from swarmctl.adoption.changes import ABSENT, Change
from swarmctl.render.rendered_values import Values, equal
from swarmctl.spec.load import Document
from swarmctl.yamltext.source import Loc, Source

MOST = 60
_MOTION = ("kinematics", "motion")  # in the files of drivers and gates


@dataclass(frozen=True)
class Guess:
    """A value for a place of the spec, or of the file of the robot type ``type_name`` beside it."""

    loc: tuple[str | int, ...]
    value: Any
    type_name: str = ""

    @property
    def text(self) -> str:
        """The place as people read it."""
        return ".".join(map(str, self.loc))


def source_of(document: Document, guess: Guess) -> Source:
    """Returns the tree that the place of a guess belongs to."""
    return document.catalog.sources[guess.type_name] if guess.type_name else document.source


def guesses(document: Document, change: Change, origin: str, rendered: Values | None) -> Iterator[Guess]:
    """Yields guesses where to write a change of a file with this ``origin`` (see `render.bundle.File`)."""
    kind, _, name = origin.partition(".")
    found: Iterator[Guess]
    if kind == "hosts" and not name and change.key:
        found = _address(document, change)
    elif kind == "robots" and name:
        found = _of_robot(document, change, name, rendered or {})
    elif kind == "programs":
        found = _of_program(document, change, _entry(document, name))
    elif kind in ("links", "time", "ros") and not change.key:
        found = _written(document.source, (kind,), change)
    else:
        found = iter(())
    yield from islice(dict.fromkeys(one for one in found if _is_plain(one.value)), MOST)


def _address(document: Document, change: Change) -> Iterator[Guess]:
    host = str(change.key[0])
    if host in document.spec.hosts and isinstance(change.old, str) and isinstance(change.new, str):
        yield Guess(("hosts", host, "address"), change.new)


def _of_robot(document: Document, change: Change, robot: str, rendered: Values) -> Iterator[Guess]:
    spec = document.spec
    if robot not in spec.robots:
        return
    links = [number for number, link in enumerate(spec.links) if getattr(link, "robot", None) == robot]
    if change.new is not ABSENT:
        for setting in _settings(change):
            yield Guess(("robots", robot, "settings", *setting), change.new)
        if change.key[:1] == ("start",) and len(change.key) == 2:
            yield Guess(("robots", robot, *change.key), change.new)
        if change.key == ("serial", "baud"):
            yield from (Guess(("links", number, "baud"), change.new) for number in links)
        if change.key[:1] == ("commanders",) and change.key[2:] == ("priority",):
            by = rendered.get((*change.key[:2], "name"))
            for number, one in enumerate(spec.control):
                if one.by == by:
                    yield Guess(("control", number, "priority"), change.new)
    yield from _of_params(document, ("robots", robot, "driver", "params"), change)
    yield from _written(document.source, ("robots", robot), change)
    for number in links:
        yield from _written(document.source, ("links", number), change)
    yield from _of_type(document, change, spec.robots[robot].type)


def _settings(change: Change) -> Iterator[tuple[str, ...]]:
    key = change.key
    if key == ("command_timeout",):
        yield key
    elif key == ("diagnostics_rate",):
        yield "rates", "diagnostics"
    elif len(key) == 2 and key[0] in _MOTION:
        yield from {
            "wheel_separation": [("calibration", "wheel_separation")],
            "linear_max": [("limits", "linear")],
            "angular_max": [("limits", "angular")],
        }.get(str(key[1]), [])
    elif len(key) == 3 and key[0] == "sensors":
        if key[2] == "rate":
            yield "rates", str(key[1])
        yield "camera", str(key[2])


def _of_type(document: Document, change: Change, name: str) -> Iterator[Guess]:
    """Places in a robot type that lies in the spec or beside it."""
    if name in document.spec.types:
        yield from _written(document.source, ("types", name), change)
    elif name in document.catalog.sources:
        source = document.catalog.sources[name]
        yield from (Guess(one.loc, one.value, name) for one in _written(source, (), change))


def _of_program(document: Document, change: Change, program: str) -> Iterator[Guess]:
    if program not in document.spec.programs:
        return
    place = ("programs", program)
    key = change.key[1:] if document.spec.programs[program].use is not None else change.key
    if key and (key is change.key or change.key[0] == "params"):
        yield from _of_params(document, (*place, "params"), change, key)
    yield from _written(document.source, place, change)


def _of_params(
    document: Document, loc: tuple[str | int, ...], change: Change, key: tuple[str | int, ...] | None = None
) -> Iterator[Guess]:
    """The same key of the parameters in the spec; a new one there, if the mapping above it is there."""
    key = change.key if key is None else key
    holder = _node(document.source, loc[:-1])
    if key and holder is not None:
        yield Guess((*loc, *key), change.new)


def _entry(document: Document, program: str) -> str:
    """The entry of ``programs`` that makes the program: `circle` for `circle-k3`, one for each robot."""
    entries = document.spec.programs
    if program in entries:
        return program
    return max((one for one in entries if program.startswith(f"{one}-")), key=len, default="")


def _written(source: Source, loc: tuple[str | int, ...], change: Change) -> Iterator[Guess]:
    """Scalars below ``loc`` that are equal to the old value, then those that are a part of it."""
    if change.old is ABSENT or change.new is ABSENT:
        return
    data = _data(source.data, loc)
    last = change.key[-1] if change.key else None
    leaves = sorted(_leaves(loc, data), key=lambda one: one[0][-1:] != (last,))
    yield from (Guess(where, change.new) for where, one in leaves if change.key and equal(one, change.old))
    if isinstance(change.old, str) and isinstance(change.new, str):
        for where, one in sorted(leaves, key=lambda one: -len(str(one[1]))):
            if isinstance(one, (str, int, float)) and not isinstance(one, bool):
                for text in _within(str(one), change.old, change.new):
                    if (value := _like(one, text)) is not None:
                        yield Guess(where, value)


def _within(part: str, old: str, new: str) -> Iterator[str]:
    """Yields what stands in ``new`` in the place of ``part`` in ``old``, if nothing else differs."""
    start = old.find(part) if part else -1
    while start >= 0:
        head, tail = old[:start], old[start + len(part) :]
        if new.startswith(head) and new.endswith(tail) and len(new) > len(head) + len(tail):
            yield new[len(head) : len(new) - len(tail)]
        start = old.find(part, start + 1)


def _like(one: Any, text: str) -> Any:
    if isinstance(one, str):
        return text
    try:
        return type(one)(text)
    except ValueError:
        return None


def _leaves(loc: tuple[str | int, ...], data: Any) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    if isinstance(data, Mapping):
        for key, one in data.items():
            yield from _leaves((*loc, key), one)
    elif isinstance(data, tuple) and not all(isinstance(one, (str, int, float)) for one in data):
        for number, one in enumerate(data):
            yield from _leaves((*loc, number), one)
    else:
        yield loc, data
        if isinstance(data, tuple):
            yield from (((*loc, number), one) for number, one in enumerate(data))


def _data(data: Any, loc: Loc) -> Any:
    try:
        return reduce(getitem, loc, data)
    except (KeyError, IndexError, TypeError):
        return None


def _node(source: Source, loc: Loc) -> Any:
    node = source.root
    for part in loc:
        found = source.child(node, part)
        if found is None:
            return None
        node = found[1]
    return node


def _is_plain(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return all(map(_is_plain, value))
    return value is ABSENT or isinstance(value, (str, int, float))
