"""The environment of a node that looks at the graph: that of the release, with the whole graph, over UDP.

Fast DDS passes messages between processes of one host through shared memory. A process of another account may
be locked out of it, and one that is killed leaves its part there.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Iterable, Mapping

SUPER_CLIENT = "env/super_client.xml"
PROFILES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")  # of Fast DDS 3, and of 2
_DDS = "{http://www.eprosima.com}"


def of_child(release: Mapping[str, str], current: str) -> dict[str, str]:
    """The variables of the node. ``release``: those of the release in the folder ``current``."""
    found = {**release, "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
    if "ROS_DISCOVERY_SERVER" in release:
        found["ROS_SUPER_CLIENT"] = "TRUE"
        if Path(current, SUPER_CLIENT).exists():  # of a ROS that does not know the variable
            found.update(dict.fromkeys(PROFILES, f"{current}/{SUPER_CLIENT}"))
    return found


def without_shared_memory(profiles: bytes) -> bytes:
    """Returns a file of profiles without the transport through shared memory. Raises ``ET.ParseError``."""
    root = ET.fromstring(profiles)
    shared = {
        one.findtext(f"{_DDS}transport_id")
        for one in root.iter(f"{_DDS}transport_descriptor")
        if one.findtext(f"{_DDS}type") == "SHM"
    }
    for used in root.iter(f"{_DDS}userTransports"):
        _drop(used, (one for one in list(used) if one.text in shared))
    ET.register_namespace("", _DDS.strip("{}"))
    return ET.tostring(root)


def _drop(parent: ET.Element, children: Iterable[ET.Element]) -> None:
    for one in children:
        parent.remove(one)
