"""A node of a launch file as a program of a spec, and what of it cannot be kept."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Sequence
from typing import Any

from swarmctl.importing.draft import Value
from swarmctl.importing.secret_names import is_secret
from swarmctl.importing.unknown_values import Unknown
from swarmctl.robot_types.placeholders import escaped
from swarmctl.ros_packages.launched import Node, Setting


def program_fields(node: Node) -> dict[str, Value]:
    """Returns what a program has of a node whose package and executable are known."""
    values = {
        "package": node.package,
        "executable": node.executable,
        "args": [escaped(word) for word in _words(node) or ()],
        "params": {one.name: _typed(one) for one in node.parameters if not _why_left_out(one)},
        "remap": dict(node.remaps),
        "environment": {
            one.name: escaped(one.value or "") for one in node.environment if not _why_left_out(one)
        },
    }
    return {key: Value(value, node.place) for key, value in values.items() if value}


def left_out(node: Node, unknown: Unknown) -> Iterator[str]:
    """Says what of a node its program does not have, but for what is ``unknown``."""
    for one in (*node.parameters, *node.environment):
        if not unknown.has(one.place, "value") and (why := _why_left_out(one)):
            yield f"{one.place}: {one.name} {why}"
    if node.arguments is not None and _words(node) is None:
        yield f"{node.place}: its args may have a secret, or a quote that does not end"
    for text in node.rosparams:
        yield f"{text.place}: its rosparam has no key in a spec; write `params`"


def _why_left_out(one: Setting) -> str:
    """Says why a parameter or a variable is left out; empty if it is not."""
    if one.value is None:
        return "has no value here"
    return "may be a secret" if is_secret(one.name, one.value) else ""


def _words(node: Node) -> Sequence[str] | None:
    """The words of a node's `args`, as roslaunch splits them; None if they are not known, or not shown."""
    try:
        words = None if node.arguments is None else shlex.split(node.arguments)
    except ValueError:
        return None
    for word in words or ():
        name, _, value = word.partition("=")
        if is_secret(name, word) or is_secret(name, value):
            return None
    return words


def _typed(one: Setting) -> Any:
    """The value as roslaunch types it: as declared, or the first of int, double, bool that it looks like."""
    text = one.value or ""
    kinds = ("int", "double", "bool") if one.type in ("", "auto") else (one.type,)
    for kind in kinds:
        try:
            if kind == "int":
                return int(text)
            if kind == "double" and math.isfinite(number := float(text)):
                return number
        except ValueError:
            continue
        if kind in {"bool", "boolean"} and text.lower() in {"true", "false"}:
            return text.lower() == "true"
    return escaped(text)
