"""The environment of a node that looks at the graph: that of the release, with the whole graph, over UDP.

Fast DDS passes messages between processes of one host through shared memory. A process of another account may
be locked out of it, and one that is killed leaves its part there.
"""

from __future__ import annotations

from pathlib import Path
from typing import Mapping

SUPER_CLIENT = "env/super_client.xml"
UDP = {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}


def of_child(release: Mapping[str, str], current: str) -> dict[str, str]:
    """The variables of the node. ``release``: those of the release in the folder ``current``."""
    found = {**release, **UDP}
    if "ROS_DISCOVERY_SERVER" in release:
        found["ROS_SUPER_CLIENT"] = "TRUE"
        if Path(current, SUPER_CLIENT).exists():  # of Humble, which does not know the variable
            found["FASTRTPS_DEFAULT_PROFILES_FILE"] = f"{current}/{SUPER_CLIENT}"
    return found
