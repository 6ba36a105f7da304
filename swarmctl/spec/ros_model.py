"""The keys of ROS: which one a swarm runs, how its nodes find each other, and what joins several masters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field

from swarmctl.field_types import (
    ConsistencyError,
    Folder,
    GraphName,
    Group,
    HostName,
    IslandName,
    MasterPort,
    Model,
    Port,
    fits_together,
)
from swarmctl.plugins import MIDDLEWARES, MULTIMASTERS, NameIn
from swarmctl.units import Unit

Rmw = Literal["fastrtps", "cyclonedds", "zenoh"]
Method = Literal["server", "peers", "multicast", "local", "zenoh"]

#: How nodes can find each other with each rmw, what they do by default first.
METHODS: Mapping[Rmw, tuple[Method, ...]] = {
    "fastrtps": ("peers", "server", "multicast", "local"),
    "cyclonedds": ("peers", "multicast", "local"),
    "zenoh": ("zenoh",),
}
#: The methods with a process that nodes ask for the others.
SERVED: tuple[Method, ...] = ("server", "zenoh")


class Ros(Model):
    """Which ROS the swarm runs."""

    distro: Annotated[str, NameIn(MIDDLEWARES)] = Field(
        MIDDLEWARES.default, description="ROS distribution of every host."
    )
    master_port: MasterPort = Field(11311, description="TCP port of each ROS master.")
    workspace: Folder | None = Field(
        None,
        description="A catkin workspace that lies on every host, built; its packages come before those "
        "of the distribution.",
    )
    builders: tuple[HostName, ...] = Field(
        (),
        examples=[["koala-laptop"]],
        description="Hosts on which `swarmctl prepare` builds packages of `packages` that need it, each "
        "for all hosts of its distribution and its kind of processor.",
    )
    rmw: Rmw | None = Field(
        None,
        description="What carries the topics of ROS 2: `fastrtps` by default. All hosts need its package.",
    )
    domain: Annotated[int, Field(ge=0, le=101)] | None = Field(
        None,
        examples=[42],
        description="ROS_DOMAIN_ID of ROS 2, of the first island; by default a number that follows from the "
        "swarm's name. Further islands get the numbers after it.",
    )
    discovery: Method | None = Field(
        None,
        description="How nodes of ROS 2 find each other: by a discovery `server` (fastrtps) or a `zenoh` "
        "router, as `peers` that know the addresses of all hosts, by `multicast`, or only on their own host "
        "(`local`). By default `server` where `servers` are named, `local` in mode single-minded, else "
        "`peers`; for zenoh always `zenoh`.",
    )
    servers: tuple[HostName, ...] = Field(
        (),
        examples=[["koala-laptop", "k3-pi"]],
        description="Hosts that run a discovery server or a Zenoh router of ROS 2; the hub by default, if "
        "there is one. With two, nodes find each other while one of them is down.",
    )
    sros2: bool = Field(
        False,
        description="Whether nodes of ROS 2 exchange messages only with nodes whose keys `swarmctl keys` has "
        "made, encrypted, and publish only what this spec lets them (SROS 2).",
    )
    naming: Literal["address", "hosts"] = Field(
        "address",
        description="What ROS nodes and masters call their host: its `address`, or its name in this spec, "
        "which /etc/hosts then resolves on every host.",
    )
    ipv6: bool = Field(
        False,
        description="Whether ROS nodes reach each other over IPv6: by names that every host resolves to an "
        "IPv6 address. Masters of several islands then need `provider: static`.",
    )
    use_sim_time: bool = Field(
        False,
        description="Whether nodes take the time from `/clock`, which a program on each island publishes: a "
        "simulator, or `rosbag play --clock`.",
    )

    @fits_together
    def _discovers_by_its_rmw(self) -> Iterator[ConsistencyError]:
        rmw = self.rmw or "fastrtps"
        if self.discovery is not None and self.discovery not in METHODS[rmw]:
            yield ConsistencyError(
                f"`{rmw}` has no discovery `{self.discovery}`; "
                f"write {' or '.join(f'`{one}`' for one in METHODS[rmw])}, or another `rmw`",
                "discovery",
            )
        elif self.servers and self.method not in SERVED:
            yield ConsistencyError(f"discovery `{self.method}` has no servers; remove `servers`", "servers")
        if self.sros2 and self.method in SERVED:
            yield ConsistencyError(
                f"a server of discovery `{self.method}` has no keys; with SROS 2 write `discovery: peers`, "
                "without `servers` and without `rmw: zenoh`",
                "sros2",
            )

    @property
    def method(self) -> Method:
        """How nodes find each other in an island on several hosts."""
        usual = METHODS[self.rmw or "fastrtps"]
        served = next((one for one in usual if one in SERVED), usual[0]) if self.servers else usual[0]
        return self.discovery or served


class Crossing(Model):
    """A topic that crosses between islands beside those that `control` and the programs need."""

    topic: GraphName = Field(description="Its full ROS name.")
    to: tuple[IslandName, ...] = Field(
        min_length=1,
        description="The islands that receive it; in mode standalone each is named as its host.",
    )


class Multimaster(Model):
    """How islands discover each other (modes standalone and combined)."""

    provider: Annotated[str, NameIn(MULTIMASTERS)] | None = Field(
        None,
        description="Of ROS 1: `fkie`, the default, discovers by multicast; `static` knows its peers from "
        "this file. Of ROS 2: `relay`, the default.",
    )
    packages: Literal["fkie_multimaster", "multimaster_fkie", "fkie_mas"] = Field(
        "fkie_multimaster",
        description="Which of fkie's packages the hosts have: `fkie_multimaster` (1.x, part of Noetic), "
        "`multimaster_fkie` (0.8 and older) or `fkie_mas` (the multi-agent suite).",
    )
    group: Group = Field("226.0.0.0", description="Multicast group of the discovery.")
    port: Port = Field(11511, description="UDP port of the discovery.")
    heartbeat_hz: Annotated[float, Field(gt=0, le=25.5), Unit("Hz")] = Field(
        1.0, description="How often a master announces itself."
    )
    active_request_after: Annotated[float, Field(gt=0), Unit("s")] = Field(
        60.0, description="Time without a message from a master until it is queried."
    )
    remove_after: Annotated[float, Field(gt=0), Unit("s")] = Field(
        300.0, description="Time without a message from a master until it is removed."
    )
    robot_hosts: dict[HostName, tuple[HostName, ...]] = Field(
        default_factory=dict,
        examples=[{"k3-pi": ["epuck-pi"]}],
        description="Peer list of each hub; all other hubs by default where multicast may fail.",
    )
    sync_hosts: tuple[HostName, ...] = Field((), description="Only these hubs are accepted.")
    ignore_hosts: tuple[HostName, ...] = Field((), description="These hubs are ignored.")
    topics: tuple[Crossing, ...] = Field((), description="What else crosses.")
