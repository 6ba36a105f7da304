"""What compiled programs of a host depend on: its distribution, its version, its machine, its ROS."""

from __future__ import annotations

import glob
import os
import re
from typing import Callable

from . import files

_ENTRY = re.compile(r"^([A-Z_]+)=[\"']?([A-Za-z0-9._-]*)[\"']?\s*$", re.MULTILINE)
_VERSION = re.compile(r"<version[^>]*>\s*([0-9][0-9.]{0,20})\s*<")
# Packages of ros_comm, which have one version; of Debian each is installed on its own.
_PACKAGES = ("rosgraph", "roscpp", "rosmaster")


def platform(outside: Callable[[str], str]) -> str:
    """Returns the platform in one word, such as ``ubuntu-20.04-aarch64-noetic-1.16.0``.

    Its parts: os-release(5), uname(2), and the ROS of the host (see ``ros``), which is missing without one.
    """
    content = files.read(outside("/etc/os-release")) or files.read(outside("/usr/lib/os-release")) or b""
    entries = dict(_ENTRY.findall(content.decode("utf-8", "replace")))
    parts = (entries.get("ID") or "linux", entries.get("VERSION_ID", ""), os.uname().machine, ros(outside))
    return "-".join(part for part in parts if part)


def ros(outside: Callable[[str], str]) -> str:
    """Returns the ROS of the host: ``noetic-1.16.0`` in /opt/ros, ``ros-1.15.15`` of Debian, or nothing."""
    for root, name in (
        *((one, "") for one in sorted(glob.glob(outside("/opt/ros/*")))),
        (outside("/usr"), "ros"),
    ):
        for package in _PACKAGES:
            content = files.read(f"{root}/share/{package}/package.xml") or b""
            found = _VERSION.search(content.decode("utf-8", "replace"))
            if found is not None:
                return f"{name or os.path.basename(root)}-{found.group(1)}"
    return ""
