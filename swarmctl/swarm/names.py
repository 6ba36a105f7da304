"""The names that swarmctl gives: ROS namespaces and nodes, devices, systemd units. Pure text."""

from __future__ import annotations

from collections.abc import Mapping

DRIVER_NODE = "driver"


def namespace(robot: str) -> str:
    """The namespace of a robot. ROS graph names cannot contain a hyphen (wiki.ros.org/Names)."""
    return "/" + robot.replace("-", "_")


def split_topic(topic: str) -> tuple[str, str]:
    """First namespace and rest of a topic: ``/koala``, ``proximity/L0``; empty and ``map`` for ``/map``."""
    head, _, name = topic[1:].partition("/")
    return (f"/{head}", name) if name else ("", head)


def driver_node(robot: str) -> str:
    """The node of a robot's driver."""
    return f"{namespace(robot)}/{DRIVER_NODE}"


def program_node(program: str, robot: str | None) -> str:
    """The node of a program: in its robot's namespace, or in none."""
    return f"{namespace(robot) if robot else ''}/{program.replace('-', '_')}"


def multimaster_node(island: str) -> str:
    """The node of swarmctl's own multimaster for an island; it has this name at every master."""
    return f"/multimaster_{island.replace('-', '_')}"


def resolved(name: str, node: str, remap: Mapping[str, str]) -> str:
    """The full name of the relative, global or private ``name`` in ``node`` (wiki.ros.org/Names)."""
    full = _full(name, node)
    changed = {_full(old, node): _full(new, node) for old, new in remap.items()}
    return changed.get(full, full)


def _full(name: str, node: str) -> str:
    if name.startswith("/"):
        return name
    if name.startswith("~"):
        return f"{node}/{name[1:].lstrip('/')}"
    return f"{node.rpartition('/')[0]}/{name}"


def usb_device(robot: str) -> str:
    """The stable path that a udev rule gives a robot's USB serial adapter."""
    return f"/dev/swarm/{robot}"


def rfcomm_device(index: int) -> str:
    """The path of a host's rfcomm device."""
    return f"/dev/rfcomm{index}"


MASTER = "master"
MULTIMASTER = "multimaster"
WLAN = "wlan"

TOOLS = (
    "bluetooth-pair",
    "has-packages",
    "ros-client",
    "ros-exec",
    "wait-for-address",
    "wait-for-master",
    "wlan-awake",
)

# Fixed names in a release; no robot and no program may have one of them.
TAKEN = {
    MASTER: "the unit of the ROS master",
    MULTIMASTER: "the unit of the multimaster",
    WLAN: "the unit that turns off power saving of the wlan",
    "swarm": "the launch file of all robots",
    **dict.fromkeys(TOOLS, "one of the tools in a release"),
}


def unit(swarm: str, *part: str) -> str:
    """The systemd unit of one part of a swarm (master, robot, line); unique, as names contain no dot."""
    return ".".join((f"swarm-{swarm}", *part, "service"))


def runtime_folder(swarm: str, part: str) -> str:
    """The folder below /run of one part of a swarm; the dot keeps `a-b`, `c` different from `a`, `b-c`."""
    return f"swarm-{swarm}.{part}"


def target(swarm: str) -> str:
    """The systemd target of a swarm on a host."""
    return f"swarm-{swarm}.target"
