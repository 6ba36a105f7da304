"""Reads a rendered file back as values, by their place in it: two texts with equal values mean the same."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any

import yaml

from swarmctl.diagnostics import has_errors
from swarmctl.yamltext.source import parse

Key = tuple[str | int, ...]
Values = Mapping[Key, Any]

_SCALARS = (str, int, float, bool, type(None))
_MOST = 20_000  # values of one file
_HOSTS = ("hosts/block", "/etc/hosts")


class _TooManyError(Exception):
    """A file that holds more values than a rendered one can."""


@lru_cache(maxsize=64)
def values_of(path: str, text: str) -> Values | None:
    """Returns the values of a YAML file, an environment file or a block of /etc/hosts (the address of each
    name); a list of scalars is one value. None for a file of another kind, or one that cannot be read."""
    if path.endswith(".yaml"):
        return _of_yaml(text)
    if path.endswith(".env"):
        return _of_environment(text)
    return _of_hosts(text) if path in _HOSTS else None


def equal(one: Any, other: Any) -> bool:
    """Returns True for equal values; true is not 1, and 1 is 1.0."""
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(map(equal, one, other))
    return isinstance(one, bool) is isinstance(other, bool) and bool(one == other)


def same_meaning(path: str, one: str, other: str) -> bool:
    """Returns True if two texts of a file have the same values: comments and layout do not count."""
    if one == other:
        return True
    first, second = values_of(path, one), values_of(path, other)
    if first is None or second is None:
        return False
    return first.keys() == second.keys() and all(equal(first[key], second[key]) for key in first)


def _of_yaml(text: str) -> Values | None:
    """Values as ROS reads them, by YAML 1.1, within the limits of a spec on depth and aliases."""
    _, found = parse(text, "")
    if any(one.code != "YAML015" for one in found if has_errors([one])):
        return None
    try:
        data = yaml.load(text, yaml.CSafeLoader)
        return dict(_flat((), data)) if isinstance(data, dict) else None
    except (yaml.YAMLError, ValueError, RecursionError, _TooManyError):
        return None


def _flat(key: Key, value: Any, count: list[int] | None = None) -> Iterator[tuple[Key, Any]]:
    count = [0] if count is None else count
    count[0] += 1
    if count[0] > _MOST:
        raise _TooManyError
    if isinstance(value, dict) and value:
        for name, one in value.items():
            yield from _flat((*key, name if isinstance(name, int) else str(name)), one, count)
    elif isinstance(value, list) and not all(isinstance(one, _SCALARS) for one in value):
        for number, one in enumerate(value):
            yield from _flat((*key, number), one, count)
    else:
        yield key, tuple(value) if isinstance(value, list) else value


def _of_environment(text: str) -> Values | None:
    found: dict[Key, Any] = {}
    for line in text.splitlines():
        if line.strip() and not line.lstrip().startswith(("#", ";")):
            name, mark, value = line.partition("=")
            try:
                words = shlex.split(value)
            except ValueError:
                return None
            if not mark or len(words) > 1:
                return None
            found[(name.strip(),)] = words[0] if words else ""
    return found


def _of_hosts(text: str) -> Values:
    lines = (line.partition("#")[0].split() for line in text.splitlines())
    return {(name,): words[0] for words in lines if words for name in words[1:]}
