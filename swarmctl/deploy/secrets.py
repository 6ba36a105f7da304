"""The operator's secrets: environment variables, else files in `secrets/` beside the spec."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path

from swarmctl.yamltext.files import content

FOLDER = "secrets"
_MAX_BYTES = 1024  # of a file with one secret
LONGEST_PIN = 16  # characters of a Bluetooth PIN (Core Specification, vol. 3 part C, 3.2.3)


class SecretError(Exception):
    """A secret cannot be used; ``fix`` is the advice. The message never contains the secret."""

    def __init__(self, message: str, fix: str) -> None:
        super().__init__(message)
        self.fix = fix


def variable(name: str) -> str:
    """Returns the environment variable of the secret ``name``."""
    return f"SWARMCTL_SECRET_{name.upper().replace('-', '_')}"


def found(names: Iterable[str], beside: Path, environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """The secrets in ``names`` that the operator has, by name. ``beside``: the folder of the spec.

    Raises ``SecretError``.
    """
    values = {}
    for name in names:
        value, place = environment.get(variable(name)), variable(name)
        if value is None:
            file = beside / FOLDER / name
            value, place = _read(file), str(file)
        if value is not None:
            values[name] = _checked(value, name, place)
    return values


def _read(file: Path) -> str | None:
    """The content of a file without its last newline; rejects a file that others can read."""
    try:
        mode = file.stat().st_mode
        if stat.S_IMODE(mode) & 0o077:
            raise SecretError(f"{file} is readable for other users", f"chmod 600 {file}")
        return content(file, _MAX_BYTES).decode("utf-8").removesuffix("\n")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise SecretError(
            f"{file} cannot be read", f"is it a text file of yours? ({type(error).__name__})"
        ) from None


def _checked(value: str, name: str, place: str) -> str:
    if not (1 <= len(value) <= LONGEST_PIN and value.isprintable() and value.isascii() and " " not in value):
        raise SecretError(
            f"the secret {name} in {place} is not a PIN",
            f"a PIN has 1 to {LONGEST_PIN} printable ASCII characters without spaces, and nothing else",
        )
    return value
