"""The ROS variables of running processes that are not those of the current release."""

from __future__ import annotations

from contextlib import suppress

from . import files
from .clip import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterable, Mapping

    from .release_store import Home

FILE = "env/ros.env"
NAMES = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_IPV6")  # with which nodes find each other


def differences(home: Home, units: Mapping[str, Any], proc: str = "/proc") -> dict[str, list[str]]:
    """Returns by unit what its main process has differently, in words; nothing of what cannot be read.

    ``units``: their states.
    """
    content = files.read(f"{home.current_link}/{FILE}")
    if content is None:
        return {}
    wanted = _variables(content.decode("utf-8", "replace").splitlines())
    found: dict[str, list[str]] = {}
    for unit, state in units.items():
        with suppress(OSError):  # it has ended
            pid = state["pid"]
            text = files.read(f"{proc}/{pid}/environ") if pid else None
            if text:
                found[unit] = list(_compared(_variables(text.decode("utf-8", "replace").split("\0")), wanted))
    return {unit: texts for unit, texts in found.items() if texts}


def _variables(lines: Iterable[str]) -> dict[str, str]:
    pairs = (line.partition("=") for line in lines)
    return {name: value.strip('"') for name, _, value in pairs if name in NAMES}


def _compared(seen: Mapping[str, str], wanted: Mapping[str, str]) -> Iterable[str]:
    for name in NAMES:
        if name in wanted and name not in seen:
            yield f"{name} is not set, instead of {wanted[name]}"
        elif name in seen and name not in wanted:
            yield f"{name} is {clipped(seen[name])}, and the release does not set it"
        elif name in wanted and seen[name] != wanted[name]:
            yield f"{name} is {clipped(seen[name])} instead of {wanted[name]}"
