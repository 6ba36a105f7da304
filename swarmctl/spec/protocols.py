"""How a robot is spoken to: by lines of text that our own driver exchanges with it, or by rosserial."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from swarmctl.spec.topics import Topic
from swarmctl.spec.words import Model, Name

_REQUEST = r"^[\x20-\x7e]{1,80}$"
_HEAD = r"^[!-+\--~]{1,16}$"  # printable, no blank, no comma

Request = Annotated[str, Field(pattern=_REQUEST, examples=["R"])]
Head = Annotated[str, Field(pattern=_HEAD, examples=["r"])]


class Query(Model):
    """One request and its reply: a head, then whole numbers, all separated by commas."""

    send: Request = Field(description="The request, without its terminator.")
    reply: Head = Field(description="The head that the reply begins with.")
    values: int = Field(0, ge=0, le=64, description="How many numbers of the reply are used.")
    extra: int = Field(0, ge=0, le=64, description="How many more numbers may follow; they are ignored.")


class SpeedCommand(Query):
    """The request that sets both wheel speeds, with {left} and {right} where the units go."""

    send: Request = Field(examples=["D,{left},{right}"], description="The request, without its terminator.")

    @model_validator(mode="after")
    def _both_sides(self) -> SpeedCommand:
        if any(self.send.count(side) != 1 for side in ("{left}", "{right}")):
            raise ValueError("`send` of `set_speed` needs {left} and {right}, once each")
        return self


class PositionQuery(Query):
    """The request that reads both position counters, left first."""

    values: Literal[2] = Field(2, description="Left and right.")


class Identify(Model):
    """The request that names the firmware. Its version is the first number in the reply."""

    send: Request = Field(description="The request, without its terminator.")
    reply: Head = Field(description="The head that the reply begins with; text follows after a comma.")


class LineProtocol(Model):
    """Requests and replies as lines of ASCII text. A reply ends with CR, LF or both; the rest is noise."""

    kind: Literal["line"] = Field(description="Lines of text.")
    terminator: Literal["\r", "\n"] = Field("\r", description="Ends a request.")
    reply_timeout: float = Field(0.2, ge=0.01, le=2, description="Seconds to wait for a reply.")
    error_heads: Annotated[tuple[Head, ...], Field(strict=False)] = Field(
        (), examples=[["z"]], description="A reply that begins so says that the robot refused the request."
    )
    set_speed: SpeedCommand = Field(description="Sets both wheel speeds; with zeros it stops the robot.")
    read_position: PositionQuery | None = Field(None, description="Reads both position counters, left first.")
    read_proximity: Query | None = Field(
        None, description="Reads the proximity sensors, in the order of `sensors`."
    )
    identify: Identify | None = Field(None, description="Asks for the firmware version.")


class RosserialProtocol(Model):
    """A sketch that speaks rosserial. It names its topics itself; `rosserial_python` publishes and hears them
    in the robot's namespace, as the robot's driver.
    """

    kind: Literal["rosserial"] = Field(description="rosserial, as `rosserial_python` speaks it.")
    board: Name = Field(examples=["arduino-uno"], description="The microcontroller that the sketch runs on.")
    firmware_timeout: float = Field(
        gt=0,
        le=2,
        examples=[0.4],
        description="Seconds without an order after which the sketch stops the robot: nothing else does.",
    )
    publishes: Annotated[tuple[Topic, ...], Field(strict=False)] = Field(
        (),
        examples=[[{"topic": "lwheel", "type": "std_msgs/Int32", "rate": 10.0}]],
        description="Topics that the sketch publishes, in its order, each with its rate.",
    )
    subscribes: Annotated[tuple[Topic, ...], Field(strict=False)] = Field(
        examples=[[{"topic": "cmd_vel", "type": "geometry_msgs/Twist"}]],
        description="Topics that the sketch hears; `cmd_vel` is one of them.",
    )

    @model_validator(mode="after")
    def _is_a_robots(self) -> RosserialProtocol:
        for one in (*self.publishes, *self.subscribes):
            if not one.topic[0].isalpha() or "/" in one.topic:
                raise ValueError(
                    f"`{one.topic}` is no name within a robot's namespace; write one word, like `lwheel`"
                )
        silent = next((one.topic for one in self.publishes if one.rate is None), None)
        if silent is not None:
            raise ValueError(f"how often does the sketch publish `{silent}`?; add its `rate`, Hz")
        if ("cmd_vel", "geometry_msgs/Twist") not in ((one.topic, one.type) for one in self.subscribes):
            raise ValueError(
                "the sketch hears no orders; add {topic: cmd_vel, type: geometry_msgs/Twist} to `subscribes`"
            )
        return self


Protocol = Annotated[LineProtocol | RosserialProtocol, Field(discriminator="kind")]
PROTOCOLS: dict[str, type[Model]] = {"line": LineProtocol, "rosserial": RosserialProtocol}
