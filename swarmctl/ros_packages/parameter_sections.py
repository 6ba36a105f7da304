"""The nodes of a parameter file and what it has of each, of any file that YAML can read.

Source: rcl_yaml_param_parser of ros2/rcl. Unlike `parameters`, which refuses what rcl refuses, it returns
what there is: the file of a lab may be for nodes that are not here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import yaml

_MOST_KEYS = 5_000  # of a mapping, and mappings of a file
_MOST_MERGED = 4  # mappings within each other: namespaces, node, ros__parameters
_DEEPEST = 16


def loaded(content: bytes) -> Any:
    """Returns what a file of YAML has; None if it cannot be read."""
    try:
        return yaml.load(content, Loader=_Merging)
    except (yaml.YAMLError, ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None


class _Merging(yaml.SafeLoader):
    """Reads YAML as rcl does: a key that a mapping has again adds to what it had; `1e-3` is a number."""

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        super().flatten_mapping(node)
        if len(node.value) > _MOST_KEYS:
            raise yaml.YAMLError("a mapping with too many keys")


def _merged(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    loader.flatten_mapping(node)
    found: dict[Any, Any] = {}
    for key, value in node.value:
        name, one = loader.construct_object(key, deep=True), loader.construct_object(value, deep=True)
        found[name] = _both(found.get(name), one)
    return found


def _both(old: Any, new: Any, depth: int = 0) -> Any:
    if not (isinstance(old, dict) and isinstance(new, dict)) or depth > _MOST_MERGED:
        return new
    return {**old, **{key: _both(old.get(key), one, depth + 1) for key, one in new.items()}}


_Merging.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+"),
    list("-+0123456789."),
)
_Merging.add_constructor("tag:yaml.org,2002:map", _merged)


def sections(data: Any) -> Iterator[tuple[str, Mapping[Any, Any]]]:
    """Yields the nodes of a file by their full names, and what it has of each."""
    waiting = [("", data)]
    for _ in range(_MOST_KEYS):
        if not waiting or len(waiting) > 4 * _MOST_KEYS:
            return
        name, value = waiting.pop(0)
        if isinstance(value, Mapping) and isinstance(value.get("ros__parameters"), Mapping):
            yield name, value["ros__parameters"]
        elif isinstance(value, Mapping) and name.count("/") < _DEEPEST:
            waiting += [(f"{name}/{str(key).strip('/')}", one) for key, one in value.items()]


def flat(values: Mapping[Any, Any]) -> Iterator[tuple[str, Any]]:
    """Yields parameters by their names with dots."""
    waiting = [(str(key), value) for key, value in values.items()]
    for _ in range(2 * _MOST_KEYS):
        if not waiting or len(waiting) > 4 * _MOST_KEYS:
            return
        name, value = waiting.pop(0)
        if isinstance(value, Mapping) and name.count(".") < _DEEPEST:
            waiting[:0] = [(f"{name}.{key}", one) for key, one in value.items()]
        else:
            yield name, value
