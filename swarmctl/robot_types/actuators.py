"""Actuators of a robot besides its wheels: lights, sounds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import AfterValidator, Field

from swarmctl.field_types import ConsistencyError, Model, fits_together
from swarmctl.robot_types.binary_protocol import binary_request, is_binary, layout, value_range
from swarmctl.robot_types.line_protocol import INDEX, VALUE, VALUES, is_head, is_text, places_of
from swarmctl.robot_types.sensors import ElementName, distinct


class Actuator(Model):
    """Lights or sounds. One message has a value for each channel."""

    send: str | None = Field(
        None,
        min_length=2,
        max_length=400,
        examples=["L,{index},{value}"],
        description="The request for one channel, with {value} and, where there are several, {index}; or for "
        "all channels at once, with {values}. In bytes they have a layout: b4 {index:b} {value:b} 00. "
        "A class of your own writes it itself.",
    )
    reply: str | None = Field(
        None,
        max_length=80,
        examples=["l"],
        description="The head of the reply, in bytes its layout; left out for a robot that does not answer.",
    )
    channels: Annotated[
        tuple[ElementName, ...], Field(min_length=1, max_length=64, strict=False), AfterValidator(distinct)
    ] = Field(
        examples=[["left", "right"]], description="One name a channel, in the order of their index, from 0."
    )
    max: int = Field(ge=1, le=255, examples=[1], description="Largest value; the smallest is 0.")
    momentary: bool = Field(
        False,
        description="Whether it is over by itself, as a sound is: done at each message, not repeated after "
        "a lost connection.",
    )

    @property
    def binary(self) -> bool:
        """True if `send` is written for a binary protocol."""
        return self.send is not None and is_binary(self.send)

    @fits_together
    def _check_places(self) -> Iterator[ConsistencyError]:
        if self.send is None:
            return
        places = places_of(self.send)
        by_channel = VALUE in places and (len(self.channels) == 1 or INDEX in places)
        if by_channel == (VALUES in places) or not places <= {INDEX, VALUE, VALUES}:
            yield ConsistencyError(
                "`send` of an actuator needs {value}, and {index} where it has several channels; or {values} "
                "for all at once",
                "send",
            )
        elif self.binary:
            binary_request(self.send)
            layout(self.reply or "")
            largest = value_range(self.send, VALUE, VALUES)[1]
            if self.max > largest:
                yield ConsistencyError(
                    f"`send` holds {largest:g} at most, and `max` is {self.max}; write a larger "
                    "place, like {value:B}",
                    "max",
                )
        elif not is_text(self.send):
            yield ConsistencyError("`send` is 80 printable characters at most; shorten it", "send")
        elif self.reply and not is_head(self.reply):
            yield ConsistencyError(
                "`reply` is what the reply begins with, up to its first separator, without blanks",
                "reply",
            )
