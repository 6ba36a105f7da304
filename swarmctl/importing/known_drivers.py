"""Which robot type a node drives, as far as the names of its package and executable show it."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

# What people call robots of a type. A plural and two words with `_` or `-` between them count as well.
_CALLED: Mapping[str, str] = {
    "koala": "koala",
    **dict.fromkeys(("khepera3", "kheperaiii", "khepera", "k3"), "khepera3"),
    **dict.fromkeys(("epuck", "mepuck"), "epuck"),
    "epuck2": "epuck2",
}
_TWO_WORDS = re.compile(r"(?<=e)[_-](?=puck)|(?<=khepera)[_-](?=iii|3)|(?<=epuck)[_-](?=2)")
_OF_DRIVERS = re.compile("driver|node|base|serial|robots?|ros|py|cpp|controller|exe|bringup")
_OF_GROUPS = re.compile("robots?|hosts|pis")


def driven_type(package: str, executable: str, types: Collection[str]) -> str:
    """Returns the type of the robot that a node drives; empty if its names do not say so.

    All words of the executable, or of package and executable, name the robot or are words such as `driver`.
    """
    return _type_in(executable, _OF_DRIVERS, types) or _type_in(f"{package} {executable}", _OF_DRIVERS, types)


def type_of_group(group: str, types: Collection[str]) -> str:
    """Returns the type of the robots in a group of hosts called ``group``; empty if no type has its name."""
    return _type_in(group, _OF_GROUPS, types)


def _type_in(name: str, others: re.Pattern[str], types: Collection[str]) -> str:
    """The one type that a name has; empty if a word of it is neither a type's nor one of ``others``."""
    joined = _TWO_WORDS.sub("", name.lower())
    words = [one for one in re.split("[^a-z0-9]+", joined) if one and not others.fullmatch(one)]
    found = {_CALLED.get(one) or _CALLED.get(one.removesuffix("s"), "") for one in words}
    return next(iter(found)) if len(found) == 1 and found <= set(types) else ""
