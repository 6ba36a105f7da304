"""Values as parameters of ROS 2. Knows no ROS."""

from __future__ import annotations

import json
from typing import Any, Iterator, Mapping


def flat(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yields parameters with dots in their names for nested ones; what is no parameter of ROS 2 is JSON."""
    for key, value in values.items():
        name = f"{above}{key}"
        if isinstance(value, Mapping):
            yield from flat(value, f"{name}.")
        elif isinstance(value, (bool, int, float, str)):
            yield name, value
        else:
            yield name, json.dumps(value)
