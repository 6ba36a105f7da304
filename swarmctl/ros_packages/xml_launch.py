"""Reads an XML or YAML launch file of ROS 2.

Source: docs.ros.org, "Using XML, YAML, and Python for ROS 2 Launch Files"; github.com/ros2/launch, launch_xml
and launch_yaml.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from swarmctl.ros_packages.launch_values import (
    Action,
    Computed,
    Condition,
    Load,
    NotReadError,
    Text,
    Unknown,
    Variable,
    Written,
)
from swarmctl.ros_packages.python_launch import expression
from swarmctl.ros_packages.xml_tags import Tag, TooLargeError, XmlError, root_of

_OF_ROS_2 = re.compile(
    r"<node[^>]*\sexec\s*=|\$\((var|find-pkg-share|find-pkg-prefix)\s|<push[-_]ros[-_]namespace|<let\s"
)
_OF_ROS_1 = re.compile(r"<node[^>]*\stype\s*=|\$\((arg|find|optenv)\s|<(machine|rosparam|master|test)\b")
_MOST, _DEEPEST = 20_000, 32  # nodes of a YAML file
_COMMANDS = {"command", "eval", "exec-in-pkg", "find-exec", "anon", "not", "and", "or", "equals", "if"}


def is_of_ros_2(path: str, text: str) -> bool:
    """Returns True for an XML launch file of ROS 2, by its name if both ROS could read it."""
    return bool(_OF_ROS_2.search(text)) or (path.endswith(".xml") and not _OF_ROS_1.search(text))


def read_xml(text: str, _load: Load) -> Written:
    """Returns the actions of an XML launch file. Raises ``NotReadError``."""
    try:
        root = root_of(text.encode())
    except TooLargeError as error:
        raise NotReadError("it is too large", error.line) from None
    except XmlError as error:
        raise NotReadError(str(error), error.line) from None
    if root.name != "launch":
        raise NotReadError("it has no element <launch>", root.line)
    return _written(root)


def read_yaml(text: str, _load: Load) -> Written:
    """Returns the actions of a YAML launch file. Raises ``NotReadError``."""
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        raise NotReadError("it is not valid YAML", mark.line + 1 if mark else 1) from None
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        if key.value == "launch":
            return _written(_Tags().tag("launch", value))
    raise NotReadError("it has no `launch:`", 1)


class _Tags:
    """A YAML launch file as the tags that the same one in XML has."""

    def __init__(self) -> None:
        self.left, self.depth = _MOST, 0

    def tag(self, name: str, node: yaml.Node) -> Tag:
        line = node.start_mark.line + 1
        found = Tag(name, {}, line)
        self.left -= 1
        self.depth += 1
        if self.left < 0 or self.depth > _DEEPEST:
            raise NotReadError("it is too large", line)
        attributes: dict[str, str] = {}
        pairs = node.value if isinstance(node, yaml.MappingNode) else ()
        for key, value in pairs:
            if isinstance(value, yaml.ScalarNode):
                attributes[str(key.value)] = str(value.value)
            elif isinstance(value, yaml.SequenceNode) and key.value != "value":
                found.children += self.each(str(key.value), value)
            elif isinstance(value, yaml.MappingNode):
                found.children.append(self.tag(str(key.value), value))
            else:
                attributes[str(key.value)] = yaml.serialize(value).strip()
        if isinstance(node, yaml.SequenceNode):
            found.children += self.each("", node)
        found.attributes = attributes
        self.depth -= 1
        return found

    def each(self, name: str, node: yaml.SequenceNode) -> Iterator[Tag]:
        """The items of a list: actions, each below its name, or several elements ``name``."""
        for item in node.value:
            pairs = item.value if isinstance(item, yaml.MappingNode) else []
            if len(pairs) == 1 and not isinstance(pairs[0][1], yaml.ScalarNode):
                yield self.tag(str(pairs[0][0].value), pairs[0][1])
            else:
                yield self.tag(name, item)


def _written(root: Tag) -> Written:
    unread: dict[int, str] = {}
    return Written([*_actions(root, unread)], unread)


def _actions(tag: Tag, unread: dict[int, str]) -> Iterator[Action]:
    for child in tag.children:
        kind = _KINDS.get(child.name.replace("-", "_"))
        if kind is None:
            unread.setdefault(child.line, f"<{child.name}> has no key in a spec")
        else:
            yield Action(kind, child.line, _arguments(child, kind, unread), _condition(child))


def _condition(tag: Tag) -> Condition | None:
    for key, wanted in (("if", True), ("unless", False)):
        if key in tag.attributes:
            return Condition(text_of(tag.attributes[key]), wanted)
    return None


_KINDS = {
    "arg": "arg", "let": "let", "unset": "unset", "group": "group", "node": "node",
    "push_ros_namespace": "namespace", "include": "include", "set_remap": "remap",
    "set_parameter": "parameter", "set_env": "environment", "append_env": "environment",
    "node_container": "container", "load_composable_node": "load", "executable": "process",
    "timer": "children", "log": "silent", "log_info": "silent",
}  # fmt: skip


def _arguments(tag: Tag, kind: str, unread: dict[int, str]) -> Mapping[str, Any]:
    found: dict[str, Any] = {key.replace("-", "_"): text_of(one) for key, one in tag.attributes.items()}
    if kind in ("group", "children"):
        found["actions"] = [*_actions(tag, unread)]
    elif kind in ("node", "container"):
        for one in tag.children:
            if one.name not in ("param", "remap", "env", "composable_node"):
                unread.setdefault(one.line, f"<{one.name}> has no key in a spec")
        found |= {
            "package": found.get("pkg"),
            "executable": found.get("exec"),
            "arguments": found.get("args"),
            "prefix": found.get("launch_prefix"),
            "parameters": [*_parameters(tag)],
            "remappings": [(text_of(a), text_of(b)) for a, b in _pairs(tag, "remap", "from", "to", unread)],
            "env": [(a, text_of(b)) for a, b in _pairs(tag, "env", "name", "value", unread)],
        }
    elif kind == "include":
        given = [*_pairs(tag, "arg", "name", "value", unread), *_pairs(tag, "let", "name", "value", unread)]
        found["arguments"] = [(text_of(a), text_of(b)) for a, b in given]
    elif kind == "parameter":
        found["value"] = _value(tag)
    elif kind == "process":
        found["env"] = [(a, text_of(b)) for a, b in _pairs(tag, "env", "name", "value", unread)]
    if kind in ("container", "load"):
        found["components"] = [
            Action("component", one.line, {**_arguments(one, "node", unread), "plugin": _text(one, "plugin")})
            for one in tag.children
            if one.name == "composable_node"
        ]
    return found


def _text(tag: Tag, key: str) -> Any:
    return text_of(tag.attributes.get(key, ""))


def _pairs(tag: Tag, name: str, first: str, second: str, unread: dict[int, str]) -> Iterator[tuple[str, str]]:
    for one in tag.children:
        if one.name == name and _condition(one) is not None:
            unread.setdefault(one.line, f"the condition of a <{name}>, which launch does not read there")
        if one.name == name and first in one.attributes and second in one.attributes:
            yield one.attributes[first], one.attributes[second]
        elif one.name == name:
            unread.setdefault(one.line, f"<{name}> needs `{first}` and `{second}`")


def _parameters(tag: Tag) -> Iterator[Any]:
    for one in tag.children:
        if one.name == "param":
            if "from" in one.attributes:
                yield text_of(one.attributes["from"])
            elif "name" in one.attributes:
                yield {one.attributes["name"]: _value(one)}


def _value(tag: Tag) -> Any:
    """The value of a parameter, or a mapping of those within it. Text of both languages is read as YAML."""
    inner = {one.attributes.get("name", ""): _value(one) for one in tag.children if one.name == "param"}
    if inner:
        return inner
    if "value-sep" in tag.attributes or "value_sep" in tag.attributes:
        return Unknown("`value-sep`")
    text = text_of(tag.attributes.get("value", ""))
    kind = tag.attributes.get("type", "")
    return text if kind == "str" or isinstance(text, (Text, Variable, Unknown)) else Text((text,))


def text_of(text: str) -> Any:
    """Returns an attribute with its substitutions: text, or a value that a launch has."""
    parts, end = _parts(text, 0)
    if end < len(text):
        parts.append(text[end:])
    return parts[0] if len(parts) == 1 else Text(tuple(parts))


def _parts(text: str, start: int, depth: int = 0) -> tuple[list[Any], int]:
    """The parts of a text from ``start`` on, to a closing bracket within a substitution."""
    parts: list[Any] = []
    here, at, open_ = start, start, 0  # brackets that are no substitution
    while at < len(text):
        if text.startswith("$(", at) and depth < _DEEPEST:
            if at > here:
                parts.append(text[here:at])
            inner, end = _parts(text, at + 2, depth + 1)
            parts.append(_substitution(inner, text[at:end]))
            here = at = end
        elif text[at] == ")" and depth and not open_:
            if at > here:
                parts.append(text[here:at])
            return parts, at + 1
        else:
            open_ += (text[at] == "(") - (text[at] == ")")
            at += 1
    if at > here or not parts:
        parts.append(text[here:at])
    return parts, at


def _evaluated(text: str) -> str | Unknown:
    """The value of an expression, which may be in quotes."""
    text = text.strip()
    if text[:1] in ("'", '"') and text[-1:] == text[:1] and f"\\{text[0]}" in text:
        text = text[1:-1].replace(f"\\{text[0]}", text[0])
    elif text[:1] == text[-1:] == '"':
        text = text[1:-1]
    return expression(text)


def _substitution(parts: list[Any], shown: str) -> Any:
    first = parts[0] if parts and isinstance(parts[0], str) else ""
    command, _, rest = first.partition(" ")
    if command == "var":
        name, _, default = rest.strip().partition(" ")
        return Variable(name, default.strip("'\"") or None) if len(parts) == 1 else Unknown(shown)
    if command == "dirname":
        return "$(dirname)"
    if command in ("find-pkg-share", "find-pkg-prefix"):
        known = len(parts) == 1
        return f"$(find-pkg-share {rest.strip()})" if known else Text(("$(find-pkg-share ", *parts[1:], ")"))
    if command == "env":
        name, _, default = rest.strip().partition(" ")
        return Unknown(f"$(env {name})" + (f", by default `{default}`" if default else ""))
    if command == "eval":
        return Computed(_evaluated, (rest, *parts[1:]))
    return Unknown(f"$({command})" if command in _COMMANDS else shown)
