"""Which robot type a node drives, as far as the names of its package and executable show it."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

# What people call robots of a type. A word of a name may have a number behind it.
_CALLED: Mapping[str, tuple[str, ...]] = {
    "koala": ("koala", "koalas"),
    "khepera3": ("khepera3", "kheperaiii", "khepera", "kheperas", "k3", "k3s"),
    "epuck": ("epuck", "epucks", "mepuck"),
    "epuck2": ("epuck2", "epuck2s"),
}
_DRIVER_WORDS = {
    "driver",
    "node",
    "base",
    "serial",
    "robot",
    "robots",
    "ros",
    "py",
    "cpp",
    "controller",
    "exe",
    "bringup",
}
_NAMES_OF_TWO_WORDS = (
    ("e_puck", "epuck"),
    ("khepera_iii", "khepera3"),
    ("khepera_3", "khepera3"),
    ("epuck_2", "epuck2"),
)


def driven_type(package: str, executable: str, types: Collection[str]) -> str:
    """Returns the type of the robot that a node drives; empty if its names do not say so.

    All words of the executable, or of package and executable, name the robot or are words such as `driver`.
    """
    of_package, of_executable = _words(package), _words(executable)
    for words in (of_executable, of_package + of_executable):
        robots = {found for one in words if (found := _type_of(one))}
        rest = [one for one in words if not _type_of(one) and one not in _DRIVER_WORDS]
        if len(robots) == 1 and not rest and robots <= set(types):
            return robots.pop()
    return ""


def type_of_group(group: str, types: Collection[str]) -> str:
    """Returns the type of the robots in a group of hosts called ``group``; empty if no type has its name."""
    words = [one for one in _words(group) if one not in {"robot", "robots", "hosts", "pis"}]
    found = _type_of(words[0]) if len(words) == 1 else ""
    return found if found in types else ""


def _words(name: str) -> list[str]:
    text = name.lower()
    for written, meant in _NAMES_OF_TWO_WORDS:
        text = text.replace(written, meant).replace(written.replace("_", "-"), meant)
    return [one for one in re.split("[^a-z0-9]+", text) if one]


def _type_of(word: str) -> str:
    return next((name for name, words in _CALLED.items() if word in words), "")
