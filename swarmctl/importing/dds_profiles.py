"""Reads which hosts a file of Cyclone DDS or Fast DDS names, and in which role.

Source: Cyclone DDS, "Configuration reference"; Fast DDS, "XML profiles".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.ros_packages.launch_files import Place
from swarmctl.ros_packages.xml_tags import Tag, XmlError, root_of

_CYCLONE, _FAST = "CycloneDDS", ("dds", "profiles", "DDS")
_QUIET = {"xmlns", "xmlns:xsi", "xsi:schemaLocation", "profile_name", "is_default_profile"}


@dataclass(frozen=True)
class Setting:
    """One setting: ``role`` is `peer`, `server` or `domain`, or empty where a spec has no key for it."""

    role: str
    path: str  # of its element
    value: str
    place: Place


def rmw_of(text: str) -> str:
    """Returns whose file an XML file is: `cyclonedds`, `fastrtps`, or nothing."""
    try:
        name = root_of(text.encode()).name
    except XmlError:
        return ""
    return "cyclonedds" if name == _CYCLONE else "fastrtps" if name in _FAST else ""


def settings_of(path: str, text: str) -> Iterator[Setting]:
    """Yields each attribute and each text of a file; nothing of one that is no XML."""
    try:
        root = root_of(text.encode())
    except XmlError:
        return
    waiting: list[tuple[Tag, tuple[str, ...]]] = [(root, ())]
    while waiting:
        tag, above = waiting.pop(0)
        names = (*above, tag.name)
        values = [(f"{name}", value) for name, value in tag.attributes.items() if name not in _QUIET]
        values += [("", tag.text.strip())] if tag.text.strip() and not tag.children else []
        for name, value in values:
            shown = ".".join((*names, name) if name else names)
            yield Setting(_role(names, name, value), shown, value, Place(path, tag.line))
        waiting += [(child, names) for child in tag.children]


def _role(names: tuple[str, ...], attribute: str, value: str) -> str:
    path = "/".join(names).lower()
    if path.endswith("peers/peer") and attribute.lower() == "address":
        return "peer"
    if (path.endswith("domain") and attribute.lower() == "id") or path.endswith("domainid"):
        return "domain" if value.isdecimal() else ""
    if path.endswith("address"):
        if "initialpeerslist" in path:
            return "peer"
        if "discoveryserverslist" in path or "remoteserver" in path:
            return "server"
    return ""
