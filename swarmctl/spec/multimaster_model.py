"""Keys of several masters: discovery, peers and the topics that cross between islands."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from swarmctl.field_types import (
    GraphName,
    Group,
    HostName,
    IslandName,
    Model,
    Port,
)
from swarmctl.plugins import MULTIMASTERS, NameIn
from swarmctl.units import Unit


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
