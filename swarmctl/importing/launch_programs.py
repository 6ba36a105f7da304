"""A node of a launch file as a program of a spec: what can be kept, and notes about what cannot."""

from __future__ import annotations

import re
import shlex
from collections.abc import Collection, Iterator
from typing import Any

from swarmctl.importing.allowed_values import is_allowed, is_secret, name_fact
from swarmctl.importing.draft import Entry, Fact, Field
from swarmctl.robot_types.placeholders import escaped
from swarmctl.ros_packages.launched import Node, Setting

_INT = re.compile(r"[-+]?[0-9]{1,18}", re.ASCII)
_FLOAT = re.compile(r"[-+]?([0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))([eE][-+]?[0-9]{1,3})?", re.ASCII)
_WRITTEN_BY_SWARMCTL = ("ROS_",)  # variables that swarmctl sets for every host


def program_of(node: Node, where: dict[str, Field], taken: Collection[str]) -> Entry:
    """Returns the program for a node whose package, executable and name are known.

    ``where`` has its ``host``, its ``robot`` or both.
    """
    last = (node.name or "").rpartition("/")[2]
    fields = dict(where)
    fields["package"] = Fact(node.package, node.place)
    fields["executable"] = Fact(node.executable, node.place)
    remap = {
        old: new
        for old, new in node.remaps
        if is_allowed("graph name", old) and is_allowed("graph name", new)
    }
    params = {one.name: _typed(one) for one in node.parameters if _is_kept(one)}
    environment = {
        one.name: escaped(one.value or "")
        for one in node.environment
        if _is_kept(one)
        and is_allowed("variable", one.name)
        and not one.name.startswith(_WRITTEN_BY_SWARMCTL)
    }
    words = [escaped(word) for word in _words(node) or ()]
    for key, value in (("args", words), ("params", params), ("remap", remap), ("environment", environment)):
        if value:
            fields[key] = Fact(value, node.place)
    namespace = (node.name or "").rpartition("/")[0].strip("/")
    if namespace and "robot" not in where and is_allowed("namespace", namespace):
        fields["namespace"] = Fact(namespace, node.place)
    notes = list(_notes(node, remap, environment))
    if namespace and not {"robot", "namespace"} & fields.keys():
        notes.append(f"left out: its namespace {namespace} ({node.place}), which a spec cannot have")
    return Entry(name_fact(last, "node", node.place, taken), fields, tuple(notes))


def driver_notes(node: Node, used: Collection[str]) -> Iterator[str]:
    """Comments about a driver's parameters but ``used`` ones: swarmctl's own driver does not read them."""
    kept = {one.lower() for one in used}
    settings = [one for one in node.parameters if (one.value or "").lower() not in kept]
    secrets = [one for one in settings if is_secret(one.name, one.value or "")]
    others = [one.name for one in settings if one not in secrets]
    for one in secrets:
        yield f"left out: {one.name} of {one.place}, which may be a secret"
    if others:
        yield f"left out: {', '.join(others)}; swarmctl's own driver replaces the node"


def _is_kept(one: Setting) -> bool:
    return (
        bool(one.name)
        and one.value is not None
        and not is_secret(one.name, one.value)
        and is_allowed("parameter", one.value)
    )


def _notes(node: Node, remap: Collection[str], environment: Collection[str]) -> Iterator[str]:
    for one in (*node.parameters, *node.environment):
        if is_secret(one.name, one.value or ""):
            yield f"left out: {one.name} of {one.place}, which may be a secret"
        elif one.value is None:
            yield f"left out: {one.name} of {one.place}, which has no value here"
        elif not _is_kept(one) or (one in node.environment and one.name not in environment):
            yield f"left out: {one.name} of {one.place}"
    for old, _ in node.remaps:
        if old not in remap:
            yield f"left out: the remap of {old} ({node.place})"
    if _words(node) is None:
        yield f"left out: its args ({node.place})"
    for place in node.rosparams:
        yield f"left out: its rosparam ({place}); a program has `params`"


def _words(node: Node) -> list[str] | None:
    """The words of a node's `args`, as roslaunch splits them; None if they may not stand in a spec."""
    try:
        words = None if node.arguments is None else shlex.split(node.arguments)
    except ValueError:
        return None
    for word in words or ():
        name, _, value = word.partition("=")
        if is_secret(name, word) or is_secret(name, value) or not is_allowed("text", word):
            return None
    return words


def _typed(one: Setting) -> Any:
    """The value as roslaunch types it: as declared, or the first of int, double, bool that it looks like."""
    text = one.value or ""
    kind = one.type or "auto"
    if kind in {"int", "auto"} and _INT.fullmatch(text):
        return int(text)
    if kind in {"double", "auto"} and (_FLOAT.fullmatch(text) or (kind == "double" and _INT.fullmatch(text))):
        return float(text)
    if kind in {"bool", "boolean", "auto"} and text.lower() in {"true", "false"}:
        return text.lower() == "true"
    return escaped(text)
