"""Package sources of apt: which servers they name, and the one of ROS, signed by its own key."""

from __future__ import annotations

import glob
import re
import shutil
import urllib.request

from . import command, files
from .errors import FailedError, RefusedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable

    Download = Callable[[str], bytes]

_SERVER = re.compile(r"^[^#\n]*\bhttps?://([A-Za-z0-9.-]+)", re.MULTILINE)
# The archive of ROS, its suites by platform, the address of its key, the fingerprint of that
# (wiki.ros.org/noetic/Installation/Ubuntu).
_ROS = "packages.ros.org"
_SUITES = {"ubuntu-20.04": "focal"}
_KEY = "https://raw.githubusercontent.com/ros/rosdistro/master/ros.key"
_FINGERPRINT = "C1CF6E31E6BADE8868B172B4F42ED6FBAB17C654"
_LONGEST_KEY = 100_000  # bytes
KEYRING = "/usr/share/keyrings/swarm-ros-archive.asc"
LIST = "/etc/apt/sources.list.d/swarm-ros.list"


def servers(outside: Callable[[str], str]) -> list[str]:
    """Returns the servers that apt's sources name."""
    places = [outside("/etc/apt/sources.list"), *sorted(glob.glob(outside("/etc/apt/sources.list.d/*")))]
    texts = [(files.read(place) or b"").decode("utf-8", "replace") for place in places if _is_list(place)]
    return sorted({server for text in texts for server in _SERVER.findall(text)})


def downloaded(address: str) -> bytes:
    """Returns what is at an address of the web, up to the longest key. Raises ``OSError``."""
    with urllib.request.urlopen(address, timeout=30.0) as answer:
        content: bytes = answer.read(_LONGEST_KEY + 1)
    return content


def add(server: str, platform: str, outside: Callable[[str], str], download: Download = downloaded) -> None:
    """Adds the source of ROS for this platform, with its key. Raises ``RefusedError`` and ``FailedError``."""
    suite = next((name for one, name in _SUITES.items() if platform.startswith(f"{one}-")), "")
    if server != _ROS or not suite:
        raise RefusedError(f"no packages for {platform} are known at {server}")
    if shutil.which("gpg") is None:
        raise RefusedError(
            "gpg is missing; it checks the key of the source", "`apt install gnupg` on the host"
        )
    try:
        key = download(_KEY)
    except OSError as error:
        raise FailedError(f"{_KEY} cannot be fetched: {error}", "has the host internet?") from error
    place = outside(KEYRING)
    files.replace(place, key)
    shown = command.output_of(["gpg", "--show-keys", "--with-colons", "--with-fingerprint", place])
    prints = re.findall(r"^pub:.*\n(?:.*\n)??fpr:+([0-9A-F]{40}):", shown, re.MULTILINE)
    if len(key) > _LONGEST_KEY or prints != [_FINGERPRINT]:
        files.remove(place)
        raise FailedError(f"{_KEY} is not the key {_FINGERPRINT}", "add the source of ROS by hand")
    line = f"deb [signed-by={KEYRING}] http://{server}/ros/ubuntu {suite} main\n"
    files.replace(outside(LIST), line.encode())


def _is_list(place: str) -> bool:
    return place.endswith((".list", ".sources"))
