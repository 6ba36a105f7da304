"""The actions and values of a launch file of ROS 2, whichever language it is written in.

Source: github.com/ros2/launch and launch_ros, the actions and substitutions of Humble to Kilted. What only a
host, a running launch or Python knows is unknown, with the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Unknown:
    """A value that is not known here, and why; ``line`` is that of its call, where it has one."""

    why: str
    line: int = field(default=0, compare=False)
    before: str = field(default="", compare=False)  # what of a text is known in front of it


@dataclass(frozen=True)
class Variable:
    """A launch configuration: ``$(var NAME)``."""

    name: str
    default: Any = None


@dataclass(frozen=True)
class Text:
    """Parts that follow each other, of which some are substitutions."""

    parts: tuple[Any, ...]  # str, Variable, Text, Unknown


@dataclass(frozen=True)
class Computed:
    """A truth that a launch computes of others: ``equals``, ``not``, ``and``, ``or``; or ``if``, a choice.

    ``has`` is true if a file of parameters, the first one, has those of a node, the second one; ``replace``
    is the first one, in whose texts each of the others is replaced by the next, unless the second is false.

    Otherwise ``operation`` returns the value of the parts as one text.
    """

    operation: str | Callable[[str], str | Unknown]
    parts: tuple[Any, ...]


@dataclass(frozen=True)
class Rewritten:
    """A file of parameters in which Nav2 replaces the values of some names."""

    source: Any
    rewrites: Mapping[str, Any]
    root: Any = ""  # the namespace that it puts around all nodes of the file


@dataclass(frozen=True)
class Condition:
    """When an action applies: if ``value`` is true, or unless it is."""

    value: Any
    wanted: bool = True


@dataclass(frozen=True)
class Action:
    """One action: what it is, its arguments, and the line that it begins at."""

    kind: str
    line: int
    arguments: Mapping[str, Any] = field(default_factory=dict)
    condition: Condition | None = None


@dataclass(frozen=True)
class Written:
    """What a launch file is read as: its actions, and what of it is not read, by line."""

    actions: Sequence[Any]
    unread: Mapping[int, str] = field(default_factory=dict)


#: Reads a file of YAML or JSON by the text of its path; unknown for one that is not here.
Load = Callable[[Any], Any]
#: Reads the text of a launch file, which may load others. Raises ``NotReadError``.
Reader = Callable[[str, Load], Written]


class NotReadError(ValueError):
    """A file that no launch could read. ``line`` counts from 1."""

    def __init__(self, message: str, line: int) -> None:
        super().__init__(message)
        self.line = line
