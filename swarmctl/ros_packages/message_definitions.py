"""Message definitions and their checksums, as genmsg computes them (github.com/ros/genmsg)."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

_INTEGERS = {
    "int8": (-(2**7), 2**7 - 1), "byte": (-(2**7), 2**7 - 1), "uint8": (0, 2**8 - 1), "char": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1), "uint16": (0, 2**16 - 1), "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1), "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1),
}  # fmt: skip
_CONSTANT_TYPES = {*_INTEGERS, "float32", "float64", "bool", "string"}
_BUILT_IN = {*_CONSTANT_TYPES, "time", "duration"}
_FIELD_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
_FIELD_TYPE = re.compile(r"(?P<bare>[A-Za-z]\w*(?:/\w+)?)(?P<array>\[[0-9]*\])?", re.ASCII)
_SEPARATOR = "---"
_HEADER = "std_msgs/Header"

# What an action becomes (actionlib_msgs/genaction.py), beside its goal, result and feedback.
_OF_ACTION = {
    "Action": "{0}ActionGoal action_goal\n{0}ActionResult action_result\n{0}ActionFeedback action_feedback",
    "ActionGoal": "Header header\nactionlib_msgs/GoalID goal_id\n{0}Goal goal",
    "ActionResult": "Header header\nactionlib_msgs/GoalStatus status\n{0}Result result",
    "ActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\n{0}Feedback feedback",
}


class DefinitionError(ValueError):
    """A line that genmsg does not accept; ``line`` counts from 1."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True)
class Definition:
    """The fields of a message and its constants, each as genmsg writes it for the checksum."""

    constants: tuple[str, ...]
    fields: tuple[tuple[str, str], ...]  # type with its array part, name

    @property
    def types(self) -> frozenset[str]:
        """The message types of its fields."""
        bare = {kind.partition("[")[0] for kind, _ in self.fields}
        return frozenset(bare - _BUILT_IN)


def definition_of(text: str, package: str) -> Definition:
    """Returns the definition of a message of ``package``. Raises `DefinitionError`."""
    constants: list[str] = []
    fields: list[tuple[str, str]] = []
    for number, line in enumerate(text.replace("\r\n", "\n").split("\n"), 1):
        plain = line.partition("#")[0].strip()
        if not plain:
            continue
        if "=" in plain:
            constants.append(_constant(line, plain, number))
        else:
            fields.append(_field(plain, package, number))
    names = [name for _, name in fields]
    if len(set(names)) < len(names):
        raise DefinitionError(1, "two fields have one name")
    return Definition(tuple(constants), tuple(fields))


def _constant(line: str, plain: str, number: int) -> str:
    kind, *rest = [word for word in plain.split(" ") if word]
    if kind not in _CONSTANT_TYPES:
        raise DefinitionError(number, "a constant has a built-in type")
    if kind == "string":  # its value is all that follows, comments included
        name, _, value = line[line.find(" ") + 1 :].partition("=")
        return f"string {name.strip()}={value.strip()}"
    parts = [part.strip() for part in " ".join(rest).split("=")]
    if len(parts) != 2 or not _is_value(kind, parts[1]):
        raise DefinitionError(number, "a constant has the form `TYPE NAME=VALUE`, with a value of its type")
    return f"{kind} {parts[0]}={parts[1]}"


def _is_value(kind: str, text: str) -> bool:
    try:
        if kind in _INTEGERS:
            lowest, highest = _INTEGERS[kind]
            return len(text) < 25 and lowest <= int(text) <= highest
        if kind == "bool":
            return text in {"True", "False"} or text.isdecimal()
        float(text)
    except ValueError:
        return False
    return True


def _field(plain: str, package: str, number: int) -> tuple[str, str]:
    words = [word for word in plain.split(" ") if word]
    match = _FIELD_TYPE.fullmatch(words[0])
    if len(words) != 2 or match is None or not _FIELD_NAME.fullmatch(words[1]):
        raise DefinitionError(number, "a field has the form `TYPE NAME`, with a space between")
    bare, array = match["bare"], match["array"] or ""
    if bare == "Header":
        bare = _HEADER
    elif "/" not in bare and bare not in _BUILT_IN:
        bare = f"{package}/{bare}"
    return bare + array, words[1]


def messages_of_action(name: str, text: str) -> Iterator[tuple[str, str]]:
    """Yields the names and definitions of the messages that an action becomes. Raises `DefinitionError`."""
    parts: list[list[str]] = [[]]
    for line in text.replace("\r\n", "\n").split("\n"):
        if line.startswith(_SEPARATOR):
            parts.append([])
        else:
            parts[-1].append(line)
    if len(parts) != 3:
        raise DefinitionError(
            1, "an action has a goal, a result and a feedback, with a line `---` between each"
        )
    for part, lines in zip(("Goal", "Result", "Feedback"), parts, strict=True):
        yield name + part, "\n".join(lines)
    for part, form in _OF_ACTION.items():
        yield name + part, form.format(name)


def checksums(definitions: Mapping[str, Definition], known: Mapping[str, str]) -> dict[str, str]:
    """Returns the MD5 sums of messages by type, with the sums of types that are defined elsewhere.

    A message with a field whose sum is unknown has none itself.
    """
    inner = {name: one.types & definitions.keys() for name, one in definitions.items()}
    try:
        order = tuple(TopologicalSorter(inner).static_order())
    except CycleError as error:  # a message that contains itself has no sum, nor what contains it
        circle = set(error.args[1])
        return checksums({name: one for name, one in definitions.items() if name not in circle}, {
            name: value for name, value in known.items() if name not in circle
        })  # fmt: skip
    found: dict[str, str] = {}
    for name in order:
        one = definitions[name]
        sums = {kind: found.get(kind) if kind in definitions else known.get(kind) for kind in one.types}
        if None not in sums.values():
            found[name] = _checksum(one, sums)
    return found


def _checksum(one: Definition, sums: Mapping[str, str | None]) -> str:
    fields = [f"{sums.get(kind.partition('[')[0], kind)} {name}" for kind, name in one.fields]
    return hashlib.md5("\n".join((*one.constants, *fields)).encode(), usedforsecurity=False).hexdigest()
