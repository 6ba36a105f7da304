"""What may be set on an emulated robot: by its constructor as it starts, or while it runs."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swarmctl.lab.emulators.robot import Robot

SWITCHES = {
    "true": True,
    "yes": True,
    "on": True,
    "1": True,
    "false": False,
    "no": False,
    "off": False,
    "0": False,
}
KINDS: dict[type, str] = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


def number_or_switch(kind: type, value: Any) -> Any:
    """``value``, maybe a text, as ``kind``: bool, int, float or str. Raises ``ValueError`` if it is none."""
    if kind is str:
        return str(value)
    if kind is bool:
        if (text := str(value).lower()) not in SWITCHES:
            raise ValueError(f"{value!r} is neither true nor false")
        return SWITCHES[text]
    if isinstance(value, bool) or (kind is int and isinstance(value, float)):
        raise ValueError(f"{value!r} is not {KINDS[kind]}")
    return kind(value)


def settings_of(robot_type: type[Robot]) -> dict[str, type]:
    """What may be set as a robot of this type starts, and of which kind it is."""
    parameters = inspect.signature(robot_type, eval_str=True).parameters.values()
    own = {one.name: one.annotation for one in parameters if one.annotation in KINDS}
    return {**own, **robot_type.changeable}


def parsed(robot_type: type[Robot], texts: Iterable[str]) -> dict[str, Any]:
    """Settings from ``name=value`` texts; ``ValueError`` says what is wrong with one."""
    kinds = settings_of(robot_type)
    return {name: _value(kinds, name, value) for name, _, value in (text.partition("=") for text in texts)}


def build(robot_type: type[Robot], settings: Mapping[str, Any]) -> Robot:
    """A robot at rest. ``ValueError`` says what is wrong with a setting."""
    kinds = settings_of(robot_type)
    values = {name: _value(kinds, name, value) for name, value in settings.items()}
    accepted = inspect.signature(robot_type).parameters
    robot = robot_type(**{name: value for name, value in values.items() if name in accepted})
    for name, value in values.items():
        if name not in accepted:
            setattr(robot, name, value)
    return robot


def change(robot: Robot, settings: Mapping[str, Any]) -> None:
    """Set what may change while ``robot`` runs. ``ValueError`` says what is wrong with a setting."""
    fixed = settings_of(type(robot)).keys() - robot.changeable
    for name, value in settings.items():
        if name in fixed:
            raise ValueError(f"{name!r} is chosen as the robot starts; it cannot change while it runs")
        setattr(robot, name, _value(robot.changeable, name, value))


def _value(kinds: Mapping[str, type], name: str, value: Any) -> Any:
    if name not in kinds:
        near = difflib.get_close_matches(name, kinds, 1)
        meant = f"; did you mean {near[0]!r}?" if near else "."
        raise ValueError(f"unknown setting {name!r}{meant} There are: {', '.join(kinds)}")
    try:
        return number_or_switch(kinds[name], value)
    except (ValueError, TypeError):
        raise ValueError(f"setting {name!r} is {KINDS[kinds[name]]}, not {value!r}") from None
