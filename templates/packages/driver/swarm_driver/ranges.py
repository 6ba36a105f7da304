"""Numbers of a parameter file, each within its bounds. Raises ValueError."""

from __future__ import annotations

import math
from typing import Any


def between(name: str, value: Any, low: float, high: float) -> float:
    """Returns ``value`` as a number from ``low`` to ``high``. Raises ``ValueError``."""
    number = float(value)
    if not low <= number <= high:
        raise ValueError(f"`{name}` must be from {low} to {high}, not {value}")
    return number


def positive(name: str, value: Any) -> float:
    """Returns ``value`` as a finite number above 0. Raises ``ValueError``."""
    number = float(value)
    if not 0 < number < math.inf:
        raise ValueError(f"`{name}` must be greater than 0, not {value}")
    return number
