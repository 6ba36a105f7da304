"""The names that swarmctl gives: ROS namespaces and nodes, devices, systemd units. Pure text."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Mapping

DRIVER_NODE = "driver"
GATE_NODE = "gate"
GATE_OUTPUT = "gate/cmd_vel"  # on which a robot's gate publishes, in its namespace


def robot_namespace(robot: str, own: str | None) -> str:
    """Returns the namespace of a robot: its ``own``, else its name; a graph name has no hyphen."""
    return f"/{own}" if own else "/" + robot.replace("-", "_")


def split_topic(topic: str) -> tuple[str, str]:
    """First namespace and rest of a topic: ``/koala``, ``proximity/L0``; empty and ``map`` for ``/map``."""
    head, _, name = topic[1:].partition("/")
    return (f"/{head}", name) if name else ("", head)


def driver_node(namespace: str) -> str:
    """Returns the node of the driver of the robot with this namespace."""
    return f"{namespace}/{DRIVER_NODE}"


def gate_node(namespace: str) -> str:
    """Returns the node of the gate in front of the driver of the robot with this namespace."""
    return f"{namespace}/{GATE_NODE}"


def above(name: str) -> Iterator[str]:
    """Yields the namespaces that ``name`` lies in, the longest first: ``/lab/k3``, ``/lab`` of a topic."""
    space = name.rpartition("/")[0]
    while space:
        yield space
        space = space.rpartition("/")[0]


def program_node(program: str, program_namespace: str) -> str:
    """Returns the node of a program in its namespace."""
    return f"{program_namespace}/{program.replace('-', '_')}"


def multimaster_node(island: str) -> str:
    """Returns the node of swarmctl's own multimaster for an island; it has this name at every master."""
    return f"/multimaster_{island.replace('-', '_')}"


def resolved(name: str, node: str, remap: Mapping[str, str]) -> str:
    """Returns the full name of the relative, global or private ``name`` in ``node`` (wiki.ros.org/Names)."""
    full = _full(name, node)
    changed = {_full(old, node): _full(new, node) for old, new in remap.items()}
    return changed.get(full, full)


def _full(name: str, node: str) -> str:
    if name.startswith("/"):
        return name
    if name.startswith("~"):
        return f"{node}/{name[1:].lstrip('/')}"
    return f"{node.rpartition('/')[0]}/{name}"


MASTER = "master"
DISCOVERY = "discovery"
MULTIMASTER = "multimaster"
WLAN = "wlan"
FIREWALL = "firewall"
WIREGUARD = "wireguard"
ENCLAVES = "enclaves"
FIREWALL_FILE = "firewall.nft"

TOOLS = (
    "bluetooth-pair",
    "give-secrets",
    "has-packages",
    "load-firewall",
    "put-enclave",
    "refuse-beside-units",
    "restart-delay",
    "ros-client",
    "ros-exec",
    "run-node",
    "wait-for-address",
    "wait-for-master",
    "wlan-awake",
)

# Fixed names in a release; no robot and no program may have one of them.
TAKEN = {
    MASTER: "the unit of the ROS master",
    DISCOVERY: "the unit of the discovery server",
    MULTIMASTER: "the unit of the multimaster",
    FIREWALL: "the unit of the firewall",
    WIREGUARD: "the unit of WireGuard",
    ENCLAVES: "the unit of the keys of SROS 2",
    WLAN: "the unit that turns off power saving of the wlan",
    "swarm": "the launch file of all robots",
    **dict.fromkeys(TOOLS, "one of the tools in a release"),
}

LONGEST_NAME = 31
_LONGEST_INTERFACE = 15  # IFNAMSIZ - 1


def valid_name(text: str, prefix: str) -> str:
    """Returns text as a name of the spec: lower case, hyphens; ``prefix`` before what is not a letter."""
    name = re.sub("[^a-z0-9]+", "-", text.lower()).strip("-")
    is_reserved = name == "localhost" if prefix == "host" else name in TAKEN
    if not name[:1].isalpha() or is_reserved:
        name = f"{prefix}-{name}"
    return name[:LONGEST_NAME].rstrip("-")


def unit(swarm: str, *part: str) -> str:
    """Returns the systemd unit of one part of a swarm (master, robot, line). Names contain no dot."""
    return ".".join((f"swarm-{swarm}", *part, "service"))


def firewall_table(swarm: str) -> str:
    """Returns the table of nftables, of family inet, with the firewall of a swarm on a host."""
    return f"swarm-{swarm}"


def wireguard_interface(swarm: str) -> str:
    """Returns the interface of a swarm's WireGuard; Linux allows 15 characters."""
    name = f"wg-{swarm}"
    return name if len(name) <= _LONGEST_INTERFACE else f"wg-{zlib.crc32(swarm.encode()):08x}"


def runtime_folder(swarm: str, part: str) -> str:
    """Returns the folder below /run of a part of a swarm. The dot keeps `a-b`, `c` and `a`, `b-c` apart."""
    return f"swarm-{swarm}.{part}"


def target(swarm: str) -> str:
    """Returns the systemd target of a swarm on a host."""
    return f"swarm-{swarm}.target"


def ros2_name(name: str) -> str:
    """Returns a name as ROS 2 writes it: ``~/name`` for the private ``~name``."""
    return f"~/{name[1:].lstrip('/')}" if name.startswith("~") else name
