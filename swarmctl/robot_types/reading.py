"""What all sensors of a robot have in common. Knows no kind of sensor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, TypeVar

from pydantic import Field

from swarmctl.field_types import ConsistencyError, Model
from swarmctl.robot_types.protocols import BinaryProtocol, DriverProtocol, QueryName
from swarmctl.units import Unit

S = TypeVar("S", bound="Reading")
Hertz = Annotated[float, Unit("Hz")]
SensorName = QueryName


class Reading(Model):
    """What all sensors have: where in which reply their numbers stand, and how often they are wanted."""

    settings_key: ClassVar[str] = ""  # of the settings that it has of its own; empty: it has none
    set_by: ClassVar[set[str]] = set()  # keys of its type that the driver does not need
    faster: ClassVar[str] = "lower the `timeout` of its query, if it replies sooner"  # advice on slow replies

    read: QueryName | None = Field(
        None,
        examples=["position"],
        description="The query whose reply has the numbers; the one of the sensor's own name if left out.",
    )
    first: int = Field(
        0, ge=0, le=255, examples=[2], description="Which number of the reply is the first, from 0."
    )
    rate: Hertz = Field(
        ge=0,
        le=50,
        examples=[5.0],
        description="How often it is read and published unless settings change it; 0 turns it off.",
    )

    @property
    def count(self) -> int:
        """How many numbers of the reply it takes."""
        return 1

    @property
    def payload(self) -> int:
        """Bytes of its message beyond those that the message's type fixes."""
        return 0

    @property
    def derived(self) -> dict[str, float]:
        """What the driver needs that follows from keys of its type."""
        return {}

    def tuned(self: S, settings: Model) -> S:
        """Returns the sensor as the ``settings`` of a robot have it under its ``settings_key``."""
        return self.model_copy(update=getattr(settings, self.settings_key).model_dump(exclude_none=True))

    def prepared(self, protocol: BinaryProtocol, query: str, *, on: bool) -> BinaryProtocol:
        """Returns the protocol with its ``query`` as set and, if it is ``on``, the request that sets it."""
        return protocol

    @classmethod
    def type_errors(
        cls, sensors: Mapping[str, Reading], protocol: DriverProtocol, settings: Model
    ) -> Iterator[ConsistencyError]:
        """Yields contradictions of a robot type that concern this kind of sensor."""
        yield from ()
