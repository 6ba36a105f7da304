"""The ROS variables of processes, where they are not those of the release."""

from __future__ import annotations

import re
from contextlib import suppress

from . import files
from .texts import clipped

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Iterable, Mapping, Sequence

    from .release_store import Home
    from .systemd import UnitState


ROS = "env/ros.env"
_ESCAPED = re.compile(r"\\(.)")


def variables_in(text: str) -> dict[str, str]:
    """Returns the variables by name; a value may stand in double quotes."""
    lines = (line.strip() for line in text.splitlines())
    pairs = (line.partition("=") for line in lines if line and not line.startswith("#"))
    return {name: _unquoted(value) for name, _, value in pairs}


def _unquoted(value: str) -> str:
    quoted = len(value) > 1 and value[0] == value[-1] == '"'
    return _ESCAPED.sub(r"\1", value[1:-1]) if quoted else value


FILE = ROS
#: The variables with which nodes find each other, by the version of ROS.
NAMES = {
    "1": ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_IPV6"),
    "2": (
        *("ROS_DOMAIN_ID", "RMW_IMPLEMENTATION", "ROS_DISCOVERY_SERVER", "ROS_SUPER_CLIENT"),
        *("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY", "ROS2_EASY_MODE"),
        *("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE"),
        *("CYCLONEDDS_URI", "ZENOH_CONFIG_OVERRIDE"),
    ),
}


def differences(home: Home, units: Mapping[str, UnitState], proc: str = "/proc") -> dict[str, list[str]]:
    """Returns by unit what differs, in words; nothing of what cannot be read. ``units``: their states."""
    content = files.read(f"{home.current_link}/{FILE}")
    if content is None:
        return {}
    release = variables_in(content.decode("utf-8", "replace"))
    names = NAMES.get(release.get("ROS_VERSION", "1"), ())
    wanted = {name: release[name] for name in names if name in release}
    found: dict[str, list[str]] = {}
    for unit, state in units.items():
        with suppress(OSError):  # it has ended
            pid = state.pid
            text = files.read(f"{proc}/{pid}/environ") if pid else None
            if text:
                seen = dict(
                    line.split("=", 1) for line in text.decode("utf-8", "replace").split("\0") if "=" in line
                )
                found[unit] = list(_compared(names, seen, wanted))
    return {unit: texts for unit, texts in found.items() if texts}


def _compared(names: Sequence[str], seen: Mapping[str, str], wanted: Mapping[str, str]) -> Iterable[str]:
    for name in names:
        if name in wanted and name not in seen:
            yield f"{name} is not set, instead of {wanted[name]}"
        elif name in seen and name not in wanted:
            yield f"{name} is {clipped(seen[name])}, and the release does not set it"
        elif name in wanted and seen[name] != wanted[name]:
            yield f"{name} is {clipped(seen[name])} instead of {wanted[name]}"
