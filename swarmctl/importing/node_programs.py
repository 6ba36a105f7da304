"""What a program has of a node, and what it has not."""

from __future__ import annotations

import json
import math
import re
import shlex
from collections.abc import Iterator, Sequence
from typing import Any

import yaml

from swarmctl.importing.draft import Value
from swarmctl.importing.unknown_values import Unknown, is_secret
from swarmctl.robot_types.ros_launchable import escaped
from swarmctl.ros_packages.launch_files import (
    Node,
    Setting,
)


def program_fields(node: Node) -> dict[str, Value]:
    """Returns what a program has of a node whose package and executable are known."""
    words = [escaped(word) for word in _words(node) or ()]
    values = {
        **(
            {"package": node.package, "executable": node.executable, "args": words}
            if node.package
            else {"command": [escaped(node.executable or ""), *words]}
        ),
        "params": {one.name: _typed(one) for one in _parameters(node)},
        "remap": dict(node.remaps),
        "environment": {
            one.name: escaped(one.value or "") for one in node.environment if not why_left_out(one)
        },
    }
    return {key: Value(value, node.place) for key, value in values.items() if value}


def component_fields(node: Node, namespace: str) -> dict[str, Value]:
    """Returns what a program has of a component: it runs in a container of its own."""
    words = ["ros2", "component", "standalone", node.package or "", node.executable or ""]
    words += ["-n", (node.name or node.last or "").rpartition("/")[2]] if node.has_name else []
    words += ["--node-namespace", f"/{namespace}"] if namespace else []
    for old, new in node.remaps:
        words += ["-r", f"{old}:={new}"]
    for one in _parameters(node):
        text = one.value or ""
        is_other = one.type == "str" and not isinstance(_read(text), str)  # YAML reads a number, say
        words += ["-p", f"{one.name}:={json.dumps(text) if is_other else text}"]
    fields = {"command": Value([escaped(one) for one in words], node.place)}
    kept = {one.name: escaped(one.value or "") for one in node.environment if not why_left_out(one)}
    return fields | ({"environment": Value(kept, node.place)} if kept else {})


def _parameters(node: Node) -> Sequence[Setting]:
    """The last one of each name, if it is not left out."""
    last = {one.name: one for one in node.parameters}
    return [one for one in last.values() if not why_left_out(one)]


def _read(text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, LookupError, AttributeError, RecursionError):
        return None


def left_out(node: Node, unknown: Unknown) -> Iterator[str]:
    """Says what of a node its program does not have, but for what is ``unknown``."""
    for one in (*node.parameters, *node.environment):
        if not unknown.has(one.place, "value", one.name) and (why := why_left_out(one)):
            yield f"{one.place}: {one.name} {why}"
    if node.arguments is not None and _words(node) is None:
        yield f"{node.place}: its args may have a secret, or a quote that does not end"
    for text in node.rosparams:
        yield f"{text.place}: its rosparam has no key in a spec; write `params`"


def why_left_out(one: Setting) -> str:
    """Says why a parameter or a variable is left out; empty if it is not."""
    if one.value is None:
        return "is not known here"
    return "may be a secret" if is_secret(one.name, one.value) else ""


def _words(node: Node) -> Sequence[str] | None:
    """The words of a node's `args`, as roslaunch splits them; None if they are not known, or not shown."""
    if node.arguments is None:
        return None
    found: list[str] = []  # substitutions, of which each is whole

    def mark(match: re.Match[str]) -> str:
        found.append(match[0])
        return f"\0{len(found) - 1}\0"

    try:
        words = shlex.split(_SUBSTITUTION.sub(mark, node.arguments.replace("\0", "")))
    except ValueError:
        return None
    words = [_MARK.sub(lambda one: found[int(one[1])], word) for word in words]
    for word in words:
        name, _, value = word.partition("=")
        if is_secret(name, word) or is_secret(name, value):
            return None
    return words


_SUBSTITUTION = re.compile(r"\$\((?:find|find-pkg-share|find-pkg-prefix|dirname)\b[^()]*\)")
_MARK = re.compile(r"\0(\d+)\0")


def _typed(one: Setting) -> Any:
    """The value as a launch types it: as declared, or the first of int, double, bool that it looks like."""
    text = one.value or ""
    if one.type == "yaml":  # as launch_ros reads what is no constant
        found = _read(text)
        items = found if isinstance(found, list) else [found]
        if {type(item) for item in items} == {int, float}:
            items = [float(item) for item in items]
        is_one = (
            bool(items)
            and len({type(item) for item in items}) == 1
            and isinstance(items[0], (bool, int, float, str))
        )
        if not is_one or any(isinstance(item, float) and not math.isfinite(item) for item in items):
            return escaped(text)
        items = [escaped(item) if isinstance(item, str) else item for item in items]
        return items if isinstance(found, list) else items[0]
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
