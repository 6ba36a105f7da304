"""The two forms of a robot type, and the names that `driver` of a robot may be."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from pydantic import Discriminator, RootModel, Tag

from swarmctl import resources
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


SWARMCTL = "swarmctl"


class DriverNames:
    """Names of drivers; each but the first is a file of the catalog."""

    @cached_property
    def files(self) -> dict[str, Path]:
        """The files of the catalog, by the name of their driver."""
        return {file.stem: file for file in sorted((resources.templates() / "drivers").glob("*.yaml"))}

    def names(self) -> tuple[str, ...]:
        """Returns every name, swarmctl's first."""
        return (SWARMCTL, *self.files)

    def __contains__(self, name: object) -> bool:
        return name == SWARMCTL or name in self.files


DRIVERS = DriverNames()
