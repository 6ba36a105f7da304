"""The values of a driver, as it shows them and takes them while it runs. Pure.

Pure. swarmctl and the driver agree by it on which change of the file restarts the driver.
"""

from __future__ import annotations

from typing import Any, Iterator, Mapping


def shown_params(data: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the parameters of a node, in SI units; it does not read them. ``data``: its parameter file."""
    kinematics, prefix = data["kinematics"], data["frame_prefix"]
    shown = ("wheel_separation", "wheel_speed_max", "wheel_radius")
    return {
        "robot": data["robot"],
        "title": data["title"],
        "port": data["port"],
        "baud": data["serial"]["baud"],
        "command_timeout": data["command_timeout"],
        "commanders": {one["name"]: one["priority"] for one in data["commanders"]},
        "limits": {"linear": kinematics["linear_max"], "angular": kinematics["angular_max"]},
        "kinematics": {name: kinematics[name] for name in shown if name in kinematics},
        "frames": {"odom": f"{prefix}odom", "base": f"{prefix}base_link"},
        "rates": {name: sensor["rate"] for name, sensor in data["sensors"].items()},
    }


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
