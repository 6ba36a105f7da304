"""A service or an action as a program or a driver has it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import GraphName, Model
from swarmctl.text_patterns import matching

#: As ROS 2 names it; a service of ROS 1, which has no middle part, too.
ServiceType = Annotated[str, matching(
    r"^[A-Za-z][A-Za-z0-9_]*/(srv|action)/[A-Za-z][A-Za-z0-9_]*$",
    "write a service as package/srv/Type, like std_srvs/srv/Trigger, and an action as package/action/Type, "
    "like nav2_msgs/action/NavigateToPose", max_length=200, examples=["std_srvs/srv/Trigger"],
)]  # fmt: skip


class Service(Model):
    """A service or an action that a node provides or calls. Relative to its namespace."""

    name: GraphName = Field(description="Its ROS name.", examples=["save_map"])
    type: ServiceType = Field(
        description="Its type: package/srv/Type of a service, package/action/Type of an action."
    )
