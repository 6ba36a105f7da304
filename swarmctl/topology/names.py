"""ROS names, made in one place: namespaces, node names, frames, device names. Pure text."""

from __future__ import annotations

from collections.abc import Mapping

DRIVER_NODE = "driver"

# Nodes that the master and multimaster bring with them; multimaster leaves them out by these names.
ALWAYS_THERE = {
    "rosout": "every ROS master",
    "master_discovery": "multimaster",
    "master_sync": "multimaster",
    "node_manager": "multimaster",
    "node_manager_daemon": "multimaster",
    "param_sync": "multimaster",
    "zeroconf": "multimaster",
    "mas_discovery": "multimaster",
    "mas_sync": "multimaster",
    "mas_daemon": "multimaster",
}


def namespace(robot: str) -> str:
    """The namespace of a robot. ROS graph names know no hyphen (wiki.ros.org/Names)."""
    return "/" + robot.replace("-", "_")


def parted(topic: str) -> tuple[str, str]:
    """The namespace of a robot and the name in it: ``/koala``, ``proximity/L0``; none at the top."""
    head, _, name = topic[1:].partition("/")
    return (f"/{head}", name) if name else ("", head)


def driver_node(robot: str) -> str:
    return f"{namespace(robot)}/{DRIVER_NODE}"


def program_node(program: str, robot: str | None) -> str:
    """The node of a program: in its robot's namespace, or at the top."""
    return f"{namespace(robot) if robot else ''}/{program.replace('-', '_')}"


def multimaster_node(island: str) -> str:
    """Our own node that joins an island's master to others; all of them know it by this name."""
    return f"/multimaster_{island.replace('-', '_')}"


def resolved(name: str, node: str, remap: Mapping[str, str]) -> str:
    """The full name of what ``node`` calls ``name``: relative, global or private (wiki.ros.org/Names)."""
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
    """The stable name that udev gives a robot's USB serial adapter."""
    return f"/dev/swarm/{robot}"


def rfcomm_device(index: int) -> str:
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

# What has a fixed name in a release; no robot and no program may be called so.
TAKEN = {
    MASTER: "the unit of the ROS master",
    MULTIMASTER: "the unit of what joins the masters",
    WLAN: "the unit of what keeps the wlan awake",
    "swarm": "the launch file of all robots",
    **dict.fromkeys(TOOLS, "one of the tools in a release"),
}


def unit(swarm: str, *part: str) -> str:
    """The systemd unit of one part of a swarm: master, robot, line. Names hold no dot, so it is unique."""
    return ".".join((f"swarm-{swarm}", *part, "service"))


def runtime_folder(swarm: str, part: str) -> str:
    """The folder below /run of one part of a swarm; the dot keeps `a-b`'s `c` apart from `a`'s `b-c`."""
    return f"swarm-{swarm}.{part}"


def target(swarm: str) -> str:
    return f"swarm-{swarm}.target"
