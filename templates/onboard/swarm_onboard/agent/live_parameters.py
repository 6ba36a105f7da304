"""Has running drivers take their parameter files without a restart, and waits until they work with them."""

from __future__ import annotations

import os
import time

from . import robot_motion, systemd
from .errors import FailedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterable, Mapping

    from .release_store import Home

_PATIENCE = 10.0  # s for a slow host to read a file
_LOOK = 1.0  # s of it after which a driver may have ended


def take(home: Home, units: Iterable[str]) -> None:
    """Returns once each of these drivers works with its file. One that does not run reads it when it starts.

    Raises ``FailedError`` for one that refuses its file, or does not work with it in time.
    """
    names = set(units)
    left = {unit: digest for unit, digest in _digests(home).items() if unit in names} if names else {}
    request = f"reload {os.urandom(8).hex()}"
    end = time.monotonic() + _PATIENCE
    while left:
        if time.monotonic() >= end:
            raise FailedError(f"{', '.join(left)} did not take its new file within {_PATIENCE:g} s")
        left = _without_it(home, left, request)


def _digests(home: Home) -> dict[str, str]:
    """The SHA-256 of the parameter file of each unit that has one in the current release."""
    current = home.current()
    files = home.manifest(current).files
    paths = {one["name"]: "params/{}.yaml".format(one["robot"]) for one in home.units(current)}
    return {unit: files[path].sha256 for unit, path in paths.items() if path in files}


def _without_it(home: Home, wanted: Mapping[str, str], request: str) -> dict[str, str]:
    """Returns those of the ``wanted`` digests, by unit, with which a driver that runs does not work yet."""
    runtime = {unit: unit[: -len(".service")] for unit in wanted}
    answers = robot_motion.ask(
        {unit: home.outside(f"/run/{folder}/{robot_motion.SOCKET}") for unit, folder in runtime.items()},
        _LOOK,
        lambda found: all(unit in found and _decided(found[unit], wanted[unit], request) for unit in wanted),
        request,
    )
    for unit, answer in answers.items():
        if answer.get("params") != wanted[unit] and answer.get("reloaded") == request:
            raise FailedError("{} keeps its parameters: {}".format(unit, answer.get("refusal")))
    left = [unit for unit in wanted if answers.get(unit, {}).get("params") != wanted[unit]]
    return {unit: wanted[unit] for unit in systemd.running(left)}


def _decided(answer: Mapping[str, Any], digest: str, request: str) -> bool:
    return answer.get("params") == digest or answer.get("reloaded") == request
