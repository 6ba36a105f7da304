"""The settings of an emulated robot: parameters of its constructor, and what may change while it runs."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any

from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.setting_values import KINDS, setting_value


def settings_of(robot_type: type[Robot]) -> dict[str, type]:
    """Returns the settings that a robot of this type starts with, and their types."""
    parameters = inspect.signature(robot_type, eval_str=True).parameters.values()
    own = {one.name: one.annotation for one in parameters if one.annotation in KINDS}
    return {**own, **robot_type.changeable}


def parsed(robot_type: type[Robot], texts: Iterable[str]) -> dict[str, Any]:
    """Returns settings from ``name=value`` texts. Raises ``ValueError`` for a wrong one."""
    kinds = settings_of(robot_type)
    return {
        name: setting_value(kinds, name, value) for name, _, value in (text.partition("=") for text in texts)
    }


def build(robot_type: type[Robot], settings: Mapping[str, Any]) -> Robot:
    """Returns a robot at rest. Raises ``ValueError`` for a wrong setting."""
    kinds = settings_of(robot_type)
    values = {name: setting_value(kinds, name, value) for name, value in settings.items()}
    accepted = inspect.signature(robot_type).parameters
    robot = robot_type(**{name: value for name, value in values.items() if name in accepted})
    for name, value in values.items():
        if name not in accepted:
            setattr(robot, name, value)
    return robot


def change(robot: Robot, settings: Mapping[str, Any]) -> None:
    """Changes settings of a running robot.

    Raises ``ValueError`` for one that is wrong or fixed.
    """
    fixed = settings_of(type(robot)).keys() - robot.changeable
    for name, value in settings.items():
        if name in fixed:
            raise ValueError(f"{name!r} is fixed when the robot starts")
        setattr(robot, name, setting_value(robot.changeable, name, value))
