"""What a migration is made of: each step looks at a spec and yields the changes of its text.

A migration from one version to the next is a tuple of steps, such as

    (*rewritten(("hosts", "*", "port"), lambda port: {("hosts", "*", "ssh", "port"): port}),
     renamed(("hosts", "*", "adress"), "address"))

where ``*`` is any key or item, and a new path has the same keys in its place. All changes of a step are made
together, so that a range changes as one; the next step sees the new text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from swarmctl.yamltext import edits
from swarmctl.yamltext.edits import Edits
from swarmctl.yamltext.source import Loc, Source

Path = tuple[str, ...]
Place = tuple[str | int, ...]
Converted = Callable[[Any], Mapping[Path, Any]]  # raises ValueError with the reason if there is no new value


class Change(NamedTuple):
    """What is done at a place of the data; without edits the text does not allow it, for a ``reason``."""

    loc: Loc
    title: str
    edits: Edits
    reason: str = ""


Step = Callable[[Source], Iterator[Change]]


def renamed(pattern: Path, name: str) -> Step:
    """Returns the step that renames a key."""

    def step(source: Source) -> Iterator[Change]:
        for loc, _ in places(source.data, pattern):
            title = f"`{path_text(loc)}` is now `{name}`"
            if _holds(source.data, (*loc[:-1], name)):
                yield Change(loc, title, (), f"`{name}` is there as well")
            else:
                yield Change(loc, title, edits.rename_key(source, loc, name))

    return step


def rewritten(pattern: Path, convert: Converted) -> tuple[Step, Step]:
    """Returns the steps that write a value elsewhere, in another unit, or as several values.

    ``convert`` returns the new values by their paths; ``pattern`` itself may be one of them.
    """

    def added(source: Source) -> Iterator[Change]:
        wanted: dict[Place, Any] = {}
        origins: dict[Place, Place] = {}
        for loc, value in places(source.data, pattern):
            new, reason = _values(loc, pattern, value, convert)
            for path, one in new.items() if not reason else ():
                if path in wanted and wanted[path] != one:
                    reason = f"`{path_text(path)}` would have two values"
                elif path != loc:
                    wanted[path] = one
                    origins |= {path[:size]: loc for size in range(1, len(path) + 1)} | origins
            if reason:
                yield Change(loc, f"`{path_text(loc)}` cannot be rewritten", (), reason)
        for at, key, one in _missing(source.data, (), _nested(wanted)):
            to = (*at, key)
            new_place, loc = path_text(to), origins[to]
            if _holds(source.data, to):
                yield Change(loc, f"`{path_text(loc)}` cannot move", (), f"`{new_place}` has another value")
            else:
                title = f"`{path_text(loc)}` is now in `{new_place}`"
                yield Change(loc, title, edits.set_key(source, at, key, one))

    def replaced(source: Source) -> Iterator[Change]:
        for loc, value in places(source.data, pattern):
            new, _ = _values(loc, pattern, value, convert)
            if loc not in new:
                yield Change(loc, f"`{path_text(loc)}` is removed", edits.remove(source, loc))
            elif new[loc] != value:
                title = f"`{path_text(loc)}` is now {new[loc]!r}"
                yield Change(loc, title, edits.replace_value(source, loc, new[loc]))

    return added, replaced


def places(data: Any, pattern: Path, above: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Yields the places and values that a pattern matches."""
    if not pattern:
        yield above, data
        return
    first, *rest = pattern
    pairs: Iterator[tuple[str | int, Any]] = iter(())
    if isinstance(data, Mapping):
        pairs = iter(data.items())
    elif isinstance(data, tuple):
        pairs = iter(enumerate(data))
    for key, value in pairs:
        if first in ("*", key):
            yield from places(value, tuple(rest), (*above, key))


def path_text(loc: Loc) -> str:
    """Returns a place as messages name it: ``links[0].port``."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).lstrip(".")


def _values(loc: Place, pattern: Path, value: Any, convert: Converted) -> tuple[Mapping[Place, Any], str]:
    """Returns the new values by their places, or why there are none."""
    try:
        new = convert(value)
    except ValueError as error:
        return {loc: value}, str(error)
    met = [part for part, word in zip(loc, pattern, strict=True) if word == "*"]
    return {_filled(path, list(met)): one for path, one in new.items()}, ""


def _filled(path: Path, met: list[str | int]) -> Place:
    return tuple(met.pop(0) if word == "*" else word for word in path)


def _nested(values: Mapping[Place, Any]) -> dict[str | int, Any]:
    nested: dict[str | int, Any] = {}
    for path, value in values.items():
        inner = nested
        for part in path[:-1]:
            inner = inner.setdefault(part, {})
        inner[path[-1]] = value
    return nested


def _missing(data: Any, at: Place, wanted: Mapping[str | int, Any]) -> Iterator[tuple[Place, str, Any]]:
    """Yields the keys to set: a mapping that is there gets only what it lacks."""
    for key, value in wanted.items():
        now = data[key] if _holds(data, (key,)) else None
        if isinstance(value, Mapping) and isinstance(now, (Mapping, tuple)):
            yield from _missing(now, (*at, key), value)
        elif now != value:
            yield at, str(key), value


def _holds(data: Any, loc: Loc) -> bool:
    for part in loc:
        known = part in data if isinstance(data, Mapping) else isinstance(part, int) and part < len(data)
        if not known:
            return False
        data = data[part]
    return True
