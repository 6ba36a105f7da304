"""The vocabulary of several masters: who joins them, how they find each other, what crosses."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from swarmctl.spec.words import GraphName, Group, HostName, IslandName, Model, Port


class Crossing(Model):
    """A topic that crosses between islands beside those that `control` and the programs ask for."""

    topic: GraphName = Field(description="Its full ROS name.")
    to: tuple[IslandName, ...] = Field(
        min_length=1,
        description="The islands that hear it; in mode standalone each is named as its host.",
    )


class Multimaster(Model):
    """How islands hear of each other (modes standalone and combined)."""

    provider: Literal["fkie", "static"] = Field(
        "fkie", description="`fkie` discovers by multicast; `static` knows its peers from this file."
    )
    packages: Literal["fkie_multimaster", "multimaster_fkie", "fkie_mas"] = Field(
        "fkie_multimaster",
        description="Which of fkie's packages the hosts have: `fkie_multimaster` (1.x, part of Noetic), "
        "`multimaster_fkie` (0.8 and older) or `fkie_mas` (the multi-agent suite).",
    )
    group: Group = Field("226.0.0.0", description="Multicast group of the discovery.")
    port: Port = Field(11511, description="UDP port of the discovery.")
    heartbeat_hz: Annotated[float, Field(gt=0, le=25.5)] = Field(
        1.0, description="How often a master says that it is there, Hz."
    )
    active_request_after: Annotated[float, Field(gt=0)] = Field(
        60.0, description="Seconds of silence after which a master is asked whether it is still there."
    )
    remove_after: Annotated[float, Field(gt=0)] = Field(
        300.0, description="Seconds of silence after which a master is forgotten."
    )
    robot_hosts: dict[HostName, tuple[HostName, ...]] = Field(
        default_factory=dict,
        examples=[{"k3-pi": ["epuck-pi"]}],
        description="By hub: the hubs it greets one by one; all of them by default where multicast may fail.",
    )
    sync_hosts: tuple[HostName, ...] = Field((), description="Only these hubs are listened to.")
    ignore_hosts: tuple[HostName, ...] = Field((), description="These hubs are not listened to.")
    topics: tuple[Crossing, ...] = Field((), description="What else crosses.")
