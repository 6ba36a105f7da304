"""The parameter file of one program as frozen values. Written by swarmctl, readable by people."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping

import yaml

SETTINGS = Path(__file__).parent / "settings.yaml"


class ConfigError(Exception):
    """An invalid parameter file: what is wrong, and where in it."""


@dataclass(frozen=True)
class Target:
    """A robot and the topic of its commands; ``stamped``: with a header, as TwistStamped."""

    robot: str
    topic: str
    stamped: bool = False


@dataclass(frozen=True)
class Config:
    """The parameter file of a program. ``settings`` has a value for each setting, ``bounds`` its range."""

    node: str
    targets: tuple[Target, ...]
    settings: Mapping[str, Any]
    bounds: Mapping[str, tuple[float, float]]

    @property
    def robots(self) -> tuple[str, ...]:
        """The names of the robots that the program may drive."""
        return tuple(target.robot for target in self.targets)


def load(path: Path, program: str) -> Config:
    """Returns the parameters of ``program`` in ``path``. Raises ``ConfigError``."""
    try:
        data = yaml.safe_load(path.read_text("utf-8"))
        known = yaml.safe_load(SETTINGS.read_text("utf-8"))[program]
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"cannot read {path}: {error}") from error
    try:
        return parse(data, known)
    except KeyError as error:
        raise ConfigError(f"{path}: the key {error} is missing") from error
    except (TypeError, ValueError, AttributeError) as error:
        raise ConfigError(f"{path}: {error}") from error


def parse(data: Mapping[str, Any], known: Mapping[str, Any]) -> Config:
    """Returns the parameters in ``data``.

    Raises ``KeyError``, ``TypeError`` or ``ValueError`` if it is not what swarmctl writes.
    """
    targets = tuple(_target(one) for one in data["targets"])
    if not targets:
        raise ValueError("no robot to command: `control` in the swarm's spec gives it some")
    return Config(
        node=str(data["node"]),
        targets=targets,
        settings=resolved(data.get("params") or {}, known),
        bounds={
            name: (setting["min"], setting["max"]) for name, setting in known.items() if "min" in setting
        },
    )


def _target(data: Mapping[str, Any]) -> Target:
    return Target(str(data["robot"]), str(data["topic"]), bool(data.get("stamped", False)))


def resolved(params: Mapping[str, Any], known: Mapping[str, Any]) -> Mapping[str, Any]:
    """Returns a value for every known setting: the user's own, or the default. Raises ``ValueError``."""
    for name, value in params.items():
        if name not in known:
            raise ValueError(f"there is no setting `{name}`")
        if not takes(known[name], value):
            raise ValueError(f"`{name}` cannot be {value!r}")
    return {name: params.get(name, setting["default"]) for name, setting in known.items()}


def takes(setting: Mapping[str, Any], value: Any) -> bool:
    """Returns True if the setting accepts a value: of the type of its default, within its bounds."""
    default = setting["default"]
    if isinstance(default, str):
        return isinstance(value, str) and re.fullmatch(setting["pattern"], value) is not None
    if isinstance(value, bool) or not isinstance(value, (int, type(default))):
        return False
    return bool(setting["min"] <= value <= setting["max"])
