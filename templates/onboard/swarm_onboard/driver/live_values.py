"""The values of a driver's parameter file that it takes while it runs: its dead-man's timeout, rates, limits.

Pure. swarmctl and the driver agree by it on which change of the file restarts the driver.
"""

from __future__ import annotations

from typing import Any, Iterator, Mapping

_TOP = ("command_timeout", "diagnostics_rate")
_LIMITS = ("linear_max", "angular_max", "wheel_speed_max")


def fixed(data: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the parameters in ``data`` without these values; of a sensor's rate, whether it is on."""
    return {
        **{key: value for key, value in data.items() if key not in _TOP},
        "kinematics": {key: value for key, value in data["kinematics"].items() if key not in _LIMITS},
        "sensors": {name: {**one, "rate": one["rate"] > 0} for name, one in data["sensors"].items()},
    }


def differing(before: Mapping[str, Any], after: Mapping[str, Any], above: str = "") -> Iterator[str]:
    """Yields the names of the values that differ, with a dot between levels."""
    for key in {**before, **after}:
        old, new = before.get(key), after.get(key)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            yield from differing(old, new, f"{above}{key}.")
        elif old != new:
            yield f"{above}{key}"
