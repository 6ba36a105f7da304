"""The effective spec as YAML, with the origin of each value as a comment, or as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.spec.effective_spec import Flat, Origin
from swarmctl.yamltext.scalars import literal, text_of

_WIDEST = 60  # how far a long value may move the comments of all the others to the right


def yaml_of(flat: Flat, *, origins: bool = False) -> str:
    """The YAML text, which reads as the same swarm."""
    lines = list(_block(flat, ""))
    if not origins:
        return "".join(f"{text}\n" for text, _ in lines)
    width = min(max(len(text) for text, _ in lines), _WIDEST)
    return "".join(f"{text:<{width}}  # {origin_of(origin)}\n" for text, origin in lines)


def json_of(flat: Flat) -> dict[str, Any]:
    """The plain data, and the origin of each value by its JSON pointer (RFC 6901)."""
    return {"spec": _data(flat), "origins": dict(_pointers(flat, ""))}


def origin_of(origin: Origin) -> str:
    """Such as ``swarm.yaml:12``, ``overlay field.yaml:3``, ``type epuck`` or ``swarmctl``."""
    place = f"{origin.span.file}:{origin.span.line}" if origin.span else ""
    return f"{origin.layer} {place}".strip()


def _block(flat: Flat, indent: str) -> Iterator[tuple[str, Origin]]:
    """The lines of a mapping or of a list of mappings, each with its origin."""
    if isinstance(flat.value, Mapping):
        for key, one in flat.value.items():
            yield from _entry(f"{indent}{text_of(key)}:", one, f"{indent}  ")
    elif isinstance(flat.value, list):
        for one in flat.value:
            lines = list(_block(one, f"{indent}  "))
            first, origin = lines[0]
            yield f"{indent}- {first.lstrip()}", origin
            yield from lines[1:]


def _entry(start: str, flat: Flat, indent: str) -> Iterator[tuple[str, Origin]]:
    if _is_block(flat):
        yield start, flat.origin
        yield from _block(flat, indent)
    else:
        yield f"{start} {literal(_data(flat))}", flat.origin


def _is_block(flat: Flat) -> bool:
    """Whether this takes lines of its own: mappings, and lists of mappings."""
    if isinstance(flat.value, Mapping):
        return bool(flat.value)
    return isinstance(flat.value, list) and any(isinstance(one.value, Mapping) for one in flat.value)


def _data(flat: Flat) -> Any:
    if isinstance(flat.value, Mapping):
        return {key: _data(one) for key, one in flat.value.items()}
    return [_data(one) for one in flat.value] if isinstance(flat.value, list) else flat.value


def _pointers(flat: Flat, pointer: str) -> Iterator[tuple[str, dict[str, Any]]]:
    below: Mapping[Any, Flat] = {}
    if isinstance(flat.value, Mapping):
        below = flat.value
    elif isinstance(flat.value, list):
        below = dict(enumerate(flat.value))
    if not below:
        yield pointer, _origin_as_json(flat.origin)
    for part, one in below.items():
        yield from _pointers(one, f"{pointer}/{str(part).replace('~', '~0').replace('/', '~1')}")


def _origin_as_json(origin: Origin) -> dict[str, Any]:
    place = (
        {"file": origin.span.file, "line": origin.span.line, "column": origin.span.column}
        if origin.span
        else {}
    )
    return {"layer": origin.layer or "spec", **place}
