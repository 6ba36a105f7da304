"""What a spec asks of a robot before its units are stopped or restarted."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import Model
from swarmctl.units import Unit


class Maintenance(Model):
    """When swarmctl may stop or restart the units of a robot."""

    idle: Annotated[float, Unit("s")] | None = Field(
        None,
        ge=0,
        le=86_400,
        examples=[30.0],
        description="Time for which the robot had no command and did not move, as far as its driver measures "
        "that; 0 asks for nothing.",
    )
    battery: float | None = Field(
        None,
        ge=0,
        le=1,
        examples=[0.4],
        description="How full its battery must be, 0 to 1 as `percentage` of sensor_msgs/BatteryState; 0 "
        "asks for nothing.",
    )
    docked: bool | None = Field(
        None,
        examples=[True],
        description="Whether it must be docked: by a topic `docked` of type std_msgs/Bool in `publishes` of "
        "its driver, else by one of type sensor_msgs/BatteryState, with `power_supply_status` charging or "
        "full.",
    )


NO_TERMS = Maintenance()  # one for all robots without: a spec can have many thousand
