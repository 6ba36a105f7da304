"""The node names of fkie's three generations of packages.

They are fixed: each sync node leaves out other masters' discovery and sync nodes by these names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Node:
    """A node of one of the packages: what roslaunch starts, and under which name."""

    package: str
    executable: str
    name: str


@dataclass(frozen=True)
class Family:
    """The two nodes of one generation of packages."""

    discovery: Node
    sync: Node


#: By ``multimaster.packages``, which names the metapackage.
FAMILIES: Mapping[str, Family] = {
    "fkie_multimaster": Family(
        Node("fkie_master_discovery", "master_discovery", "master_discovery"),
        Node("fkie_master_sync", "master_sync", "master_sync"),
    ),
    "multimaster_fkie": Family(
        Node("master_discovery_fkie", "master_discovery", "master_discovery"),
        Node("master_sync_fkie", "master_sync", "master_sync"),
    ),
    "fkie_mas": Family(
        Node("fkie_mas_discovery", "mas-discovery", "mas_discovery"),
        Node("fkie_mas_sync", "mas-sync", "mas_sync"),
    ),
}
