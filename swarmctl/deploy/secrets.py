"""The operator's secrets: environment variables, else files in `secrets/` beside the spec."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path

from swarmctl.render.bundle import SecretForm
from swarmctl.yamltext.files import content

FOLDER = "secrets"
_MAX_BYTES = 64 << 10  # of a file with one secret
_LONGEST_LINE = 4096  # characters of an environment variable
_ALL_PINS: Mapping[str, SecretForm] = {}
LONGEST_PIN = 16  # characters of a Bluetooth PIN (Core Specification, vol. 3 part C, 3.2.3)


class SecretError(Exception):
    """A secret cannot be used; ``fix`` is the advice. The message never contains the secret."""

    def __init__(self, message: str, fix: str) -> None:
        super().__init__(message)
        self.fix = fix


def variable(name: str) -> str:
    """Returns the environment variable of the secret ``name``."""
    return f"SWARMCTL_SECRET_{name.upper().replace('-', '_')}"


def found(
    names: Iterable[str],
    beside: Path,
    environment: Mapping[str, str] = os.environ,
    forms: Mapping[str, SecretForm] = _ALL_PINS,
) -> dict[str, str]:
    """The secrets in ``names`` that the operator has, by name. ``beside``: the folder of the spec.

    ``forms`` has what those may hold that are no PIN. Raises ``SecretError``.
    """
    values = {}
    for name in names:
        value, place = environment.get(variable(name)), variable(name)
        if value is None:
            file = beside / FOLDER / name
            value, place = _read(file), str(file)
        if value is not None and forms.get(name) == "text":
            values[name] = _text(value, name, place)
        elif value is not None:
            check = _line if forms.get(name) == "line" else _pin
            values[name] = check(value.removesuffix("\n"), name, place)
    return values


def _read(file: Path) -> str | None:
    """The content of a file; rejects a file that others can read."""
    try:
        mode = file.stat().st_mode
        if stat.S_IMODE(mode) & 0o077:
            raise SecretError(f"{file} is readable for other users", f"chmod 600 {file}")
        return content(file, _MAX_BYTES).decode("utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise SecretError(
            f"{file} cannot be read", f"is it a text file of yours? ({type(error).__name__})"
        ) from None


def _pin(value: str, name: str, place: str) -> str:
    if not (1 <= len(value) <= LONGEST_PIN and value.isprintable() and value.isascii() and " " not in value):
        raise SecretError(
            f"the secret {name} in {place} is not a PIN",
            f"a PIN has 1 to {LONGEST_PIN} printable ASCII characters without spaces, and nothing else",
        )
    return value


def _line(value: str, name: str, place: str) -> str:
    if not (1 <= len(value) <= _LONGEST_LINE and value.isprintable()):
        raise SecretError(
            f"the secret {name} in {place} cannot be an environment variable",
            f"it needs one line of 1 to {_LONGEST_LINE} characters; give it to the program as a file",
        )
    return value


def _text(value: str, name: str, place: str) -> str:
    if not 1 <= len(value.encode()) <= _MAX_BYTES or "\0" in value:
        raise SecretError(
            f"the secret {name} in {place} is not a text of 1 to {_MAX_BYTES >> 10} KiB",
            "write a text file, such as a key in PEM",
        )
    return value
