"""The two forms of a robot type: with a protocol of its own, or with a ROS package as its driver."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Discriminator, RootModel, Tag

from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType

#: Tags of the two forms; brackets mark a step that is in no file.
PROTOCOL, ROS = "[protocol]", "[ros]"

AnyRobotType = RobotType | RosRobotType


def form_of(data: Any) -> str:
    """Returns the tag of the form that the data of a robot type has."""
    if isinstance(data, RosRobotType):
        return ROS
    return ROS if isinstance(data, dict) and "driver" in data and "protocol" not in data else PROTOCOL


TaggedRobotType = Annotated[
    Annotated[RobotType, Tag(PROTOCOL)] | Annotated[RosRobotType, Tag(ROS)], Discriminator(form_of)
]


def with_protocol(types: Mapping[str, AnyRobotType]) -> dict[str, RobotType]:
    """Returns those robot types that have a protocol, which swarmctl's driver knows."""
    return {name: one for name, one in types.items() if isinstance(one, RobotType)}


class RobotTypeFile(RootModel[TaggedRobotType]):
    """The file of a robot type."""
