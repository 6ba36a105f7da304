"""ROS names, made in one place: namespaces, node names, frames, device names. Pure text."""

from __future__ import annotations

DRIVER_NODE = "driver"


def namespace(robot: str) -> str:
    """The namespace of a robot. ROS graph names know no hyphen (wiki.ros.org/Names)."""
    return "/" + robot.replace("-", "_")


def driver_node(robot: str) -> str:
    return f"{namespace(robot)}/{DRIVER_NODE}"


def usb_device(robot: str) -> str:
    """The stable name that udev gives a robot's USB serial adapter."""
    return f"/dev/swarm/{robot}"


def rfcomm_device(index: int) -> str:
    return f"/dev/rfcomm{index}"


MASTER = "master"  # the one part of a swarm that has a fixed name; no robot may be called so


def unit(swarm: str, *part: str) -> str:
    """The systemd unit of one part of a swarm: master, robot, line. Names hold no dot, so it is unique."""
    return ".".join((f"swarm-{swarm}", *part, "service"))


def runtime_folder(swarm: str, part: str) -> str:
    """The folder below /run of one part of a swarm; the dot keeps `a-b`'s `c` apart from `a`'s `b-c`."""
    return f"swarm-{swarm}.{part}"


def target(swarm: str) -> str:
    return f"swarm-{swarm}.target"
