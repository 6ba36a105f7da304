"""Changes of plain data and of trees, which return new ones; the nodes of a tree keep their positions."""

from __future__ import annotations

from typing import Any

import yaml

from swarmctl.yamltext.compose import like
from swarmctl.yamltext.source import Loc

REMOVED = object()


def value_at(data: Any, loc: Loc) -> Any:
    """Returns what stands at ``loc``, None if nothing does."""
    for step in loc:
        if isinstance(data, dict):
            data = data.get(step)
        elif isinstance(data, tuple) and isinstance(step, int) and step < len(data):
            data = data[step]
        else:
            return None
    return data


def with_value(data: Any, loc: Loc, value: Any) -> Any:
    """Returns the data with another value at ``loc``, or without it, for `REMOVED`."""
    if not loc:
        return value
    step, *rest = loc
    if isinstance(data, tuple) and isinstance(step, int) and step < len(data):
        new = with_value(data[step], rest, value)
        return (*data[:step], *(() if new is REMOVED else (new,)), *data[step + 1 :])
    if not isinstance(data, dict):
        return data
    new = with_value(data.get(step, {}), rest, value)
    return (
        {**data, step: new} if new is not REMOVED else {key: one for key, one in data.items() if key != step}
    )


def with_key(node: yaml.Node | None, loc: Loc, name: str) -> yaml.Node | None:
    """Returns the tree with another key at ``loc``, in the place of the one that is there."""
    if not isinstance(node, yaml.MappingNode):
        return node
    step, *rest = loc
    pairs = []
    for key, value in node.value:
        if key.value == step and not rest:
            key = yaml.ScalarNode(key.tag, name, key.start_mark, key.end_mark, key.style)  # noqa: PLW2901
        pairs.append((key, with_key(value, rest, name) if key.value == step and rest else value))
    return like(node, pairs)


def without_item(node: yaml.Node | None, loc: Loc) -> yaml.Node | None:
    """Returns the tree without the item at ``loc``, if it has that."""
    step, *rest = loc
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
        items = list(node.value)
        items[step : step + 1] = [without_item(items[step], rest)] if rest else []
        return like(node, items)
    if isinstance(node, yaml.MappingNode):
        pairs = [(key, without_item(one, rest) if key.value == step else one) for key, one in node.value]
        return like(node, pairs)
    return node
