"""A topic as a program or a sketch has it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import GraphName, Model, TypeName
from swarmctl.units import Unit


class Topic(Model):
    """A topic that a program or a robot's sketch publishes or subscribes to. Relative to its namespace."""

    topic: GraphName = Field(description="Its ROS name.")
    type: TypeName = Field(description="Its message type.")
    rate: Annotated[float, Field(gt=0, le=10_000), Unit("Hz")] | None = Field(
        None, examples=[30.0], description="Messages per second, for the budgets of links."
    )
    size: Annotated[int, Field(ge=1), Unit("B")] | None = Field(
        None,
        examples=[921600],
        description="Size of a message as sent, where its type does not fix it (images, maps, text).",
    )
