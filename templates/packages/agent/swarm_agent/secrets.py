"""The secrets of a swarm: a file each below /etc/swarm, for root alone. No record and no answer holds one."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from typing import TYPE_CHECKING, Iterable

from . import files
from .errors import RefusedError
from .manifest import secret_names
from .paths import KEPT
from .release_store import Home

if TYPE_CHECKING:
    from .messages import SecretState


def _folder(home: Home) -> str:
    return home.outside(f"{KEPT}/{home.swarm}/secrets")


def offered(payload: bytes) -> dict[str, bytes]:
    """Returns the secrets in a payload, by name. Raises ``RefusedError``."""
    values = json.loads(payload.decode("utf-8")) if payload else {}
    if not isinstance(values, dict) or not all(isinstance(one, str) for one in values.values()):
        raise RefusedError("not secrets of swarmctl", "are swarmctl and its agent of one version?")
    return {name: values[name].encode("utf-8") for name in secret_names(list(values))}


def states(home: Home, names: Iterable[str], values: dict[str, bytes]) -> dict[str, SecretState]:
    """By name: ``same``, ``other`` or ``new`` if a value is offered; without one ``kept`` or ``missing``."""
    found: dict[str, SecretState] = {}
    for name in names:
        kept = files.read(f"{_folder(home)}/{name}")
        if name not in values:
            found[name] = "missing" if kept is None else "kept"
        else:
            found[name] = "new" if kept is None else "same" if kept == values[name] else "other"
    return found


def keep(home: Home, values: dict[str, bytes]) -> None:
    """Stores the values in files for root alone."""
    os.makedirs(os.path.dirname(_folder(home)), 0o755, exist_ok=True)
    os.makedirs(_folder(home), 0o700, exist_ok=True)
    for name, value in values.items():
        files.replace(f"{_folder(home)}/{name}", value, mode=0o600)


def forget_unneeded(home: Home, releases: Iterable[str | None]) -> None:
    """Removes the secrets that none of these releases needs; none if a manifest of them is damaged."""
    manifests = [home.known_manifest(release) for release in releases if release]
    if None not in manifests:
        forget(home, but={name for one in manifests if one for name in one.secrets})


def forget(home: Home, but: Iterable[str] = ()) -> None:
    """Removes every secret that is not named, and empty folders."""
    folder = _folder(home)
    if not os.path.isdir(folder):
        return
    for name in set(os.listdir(folder)) - set(but):
        files.remove(f"{folder}/{name}")
    with suppress(OSError):
        os.rmdir(folder)
        os.rmdir(os.path.dirname(folder))
        os.rmdir(home.outside(KEPT))
