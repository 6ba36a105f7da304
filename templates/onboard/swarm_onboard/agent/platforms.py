"""What compiled programs of a host depend on: its distribution, its version, its machine, its ROS."""

from __future__ import annotations

import os

from . import files
from .texts import is_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterator

ROS = "/opt/ros"
# Packages of ros_comm, which have one version; of Debian each is installed on its own.
_PACKAGES = ("rosgraph", "roscpp", "rosmaster")


def platform(outside: Callable[[str], str]) -> str:
    """Returns the platform in one word, such as ``ubuntu-20.04-aarch64-noetic-1.16.0``.

    Its parts: os-release(5), uname(2), and the ROS of the host (see ``ros``), which is missing without one.
    """
    content = files.read(outside("/etc/os-release")) or files.read(outside("/usr/lib/os-release")) or b""
    entries = dict(_entries(content.decode("utf-8", "replace")))
    parts = (entries.get("ID") or "linux", entries.get("VERSION_ID", ""), os.uname().machine, ros(outside))
    return "-".join(part for part in parts if part)


def ros(outside: Callable[[str], str]) -> str:
    """Returns the ROS of the host: ``noetic-1.16.0`` in /opt/ros, ``ros-1.15.15`` of Debian, or nothing."""
    for root, name in (
        *((outside(f"{ROS}/{one}"), one) for one in distributions(outside)),
        (outside("/usr"), "ros"),
    ):
        for package in _PACKAGES:
            if found := version(f"{root}/share/{package}/package.xml"):
                return f"{name}-{found}"
    return ""


def distributions(outside: Callable[[str], str]) -> list[str]:
    """Returns the names of the folders in ``/opt/ros``."""
    try:
        return sorted(name for name in os.listdir(outside(ROS)) if not name.startswith("."))
    except (FileNotFoundError, NotADirectoryError):
        return []


def version(manifest: str) -> str:
    """Returns the version in the file of a package.xml (REP 127, REP 140), or no text."""
    for part in (files.read(manifest) or b"").decode("utf-8", "replace").split("<version")[1:]:
        found = part.partition(">")[2].partition("<")[0].strip()
        if found and not found.strip("0123456789.") and found[0] != ".":
            return found[:21]
    return ""


def _entries(text: str) -> Iterator[tuple[str, str]]:
    """Yields the assignments of os-release(5) whose values are words, without quotes."""
    for line in text.splitlines():
        key, _, value = line.partition("=")
        word = value.strip().strip("\"'")
        if not word or is_name(word, "._-", 100):
            yield key, word
