"""What the parameter files of nodes have in common: how they are read, numbers within bounds."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, Callable, TypeVar

T = TypeVar("T")


class ConfigError(Exception):
    """An invalid parameter file: what is wrong, and where in it."""


def loaded(path: Path, parse: Callable[[Any], T]) -> T:
    """Returns what ``parse`` makes of the YAML file ``path``. Raises ``ConfigError``."""
    return parsed(path, content_of(path), parse)


def content_of(path: Path) -> bytes:
    """Returns the content of the file ``path``. Raises ``ConfigError``."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error}") from error


def parsed(path: Path, content: bytes, parse: Callable[[Any], T]) -> T:
    """Returns what ``parse`` makes of the ``content`` of the YAML file ``path``. Raises ``ConfigError``."""
    import yaml  # noqa: PLC0415  the agent has this package as well, on hosts without PyYAML

    try:
        data = yaml.safe_load(content.decode("utf-8"))
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"cannot read {path}: {error}") from error
    try:
        return parse(data)
    except KeyError as error:
        raise ConfigError(f"{path}: the key {error} is missing") from error
    except (TypeError, ValueError, AttributeError, re.error) as error:
        raise ConfigError(f"{path}: {error}") from error


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


def one_of(name: str, value: Any, known: tuple[str, ...]) -> str:
    """Returns ``value`` if it is among ``known``. Raises ``ValueError``."""
    if value not in known:
        raise ValueError(f"`{name}` must be one of {', '.join(known)}, not {value}")
    return str(value)
