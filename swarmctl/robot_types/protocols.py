"""Protocols of robots: lines of text, bytes, a Python class, or rosserial."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field

from swarmctl.field_types import ConsistencyError, GraphName, Model, Name, Value, fits_together
from swarmctl.robot_types.binary_protocol import (
    BinaryExchange,
    BinaryIdentify,
    BinaryQuery,
    BinarySpeedCommand,
)
from swarmctl.robot_types.line_protocol import (
    CodedExchange,
    CodedQuery,
    Head,
    Identify,
    Query,
    Separator,
    Setup,
    SpeedCommand,
)
from swarmctl.robot_types.ros_launchable import Topic
from swarmctl.text_patterns import matching
from swarmctl.units import Unit

QueryName = Annotated[
    str, matching(r"^[a-z][a-z0-9_]{0,30}$", "lower-case letters, digits and _, a letter first, 31 at most")
]
ReplyTimeout = Annotated[float, Field(ge=0.01, le=2, description="Time to wait for a reply."), Unit("s")]
Loc = tuple[str | int, ...]
_MOST = 64  # requests, and lines, that a robot is made to know
UNO_BOARDS = ("arduino-uno", "arduino-nano")  # an ATmega328P at 16 MHz, pins as on an UNO
ClassName = Annotated[str, matching(
    r"^[A-Z][A-Za-z0-9_]{0,60}$",
    "a class name such as `BeetleCodec`: letters, digits and _, a capital first", examples=["BeetleCodec"],
)]  # fmt: skip
Text = Annotated[str, Field(min_length=1, max_length=200)]


class Stray(Model):
    """A line that explains why a robot does not answer as it should."""

    begins: Text = Field(examples=["Selector pos"], description="What the line begins with.")
    unless: Annotated[tuple[Text, ...], Field(strict=False)] = Field(
        (),
        examples=[["Selector pos 3"]],
        description="A line that begins so is as it should be.",
    )
    means: Text = Field(
        examples=["turn the selector to position 3"], description="What to do; shown with the line."
    )


class LineProtocol(Model):
    """Requests and replies as lines of ASCII text. A reply ends with CR, LF or both; the rest is noise."""

    kind: Literal["line"] = Field(description="Lines of text.")
    terminator: Literal["\r", "\n"] = Field("\r", description="Ends a request.")
    separator: Separator = Field(
        ",",
        description="Stands between the head and the numbers of a reply, and between the `{values}` of an "
        "actuator. A blank or a tab stands for any number of blanks and tabs.",
    )
    reply_timeout: ReplyTimeout = 0.2
    error_heads: Annotated[tuple[Head, ...], Field(strict=False)] = Field(
        (), examples=[["z"]], description="A reply that begins with one of these refuses the request."
    )
    strays: Annotated[tuple[Stray, ...], Field(max_length=_MOST, strict=False)] = Field(
        (),
        examples=[[{"begins": "Selector pos", "means": "turn the selector to position 3"}]],
        description="Lines that explain what is wrong, such as a banner of another program.",
    )
    identify: Identify | None = Field(None, description="Requests the firmware version.")
    setup: Annotated[tuple[Setup, ...], Field(max_length=_MOST, strict=False)] = Field(
        (),
        examples=[[{"send": "C,0,d31", "reply": "c"}]],
        description="Requests sent once after each connection, before the first reading, such as to "
        "switch its sensors on.",
    )
    set_speed: SpeedCommand = Field(description="Sets both wheel speeds; with zeros it stops the robot.")
    queries: Mapping[QueryName, Query] = Field(
        default_factory=dict,
        examples=[{"position": {"send": "R", "reply": "r", "values": 2}}],
        description="Other requests, by name; `sensors` gives the meaning of the numbers in the replies.",
    )

    @fits_together
    def _heads_end_at_the_separator(self) -> Iterator[ConsistencyError]:
        """A head with the separator in it would never match."""
        mark = self.separator.strip()
        heads: list[tuple[str, Loc]] = [(self.set_speed.reply, ("set_speed", "reply"))]
        heads += [(one.reply, ("queries", name, "reply")) for name, one in self.queries.items()]
        heads += [(one.reply, ("setup", number, "reply")) for number, one in enumerate(self.setup)]
        heads += [(self.identify.reply, ("identify", "reply"))] if self.identify else []
        for head, loc in heads:
            if mark and mark in head:
                yield ConsistencyError(
                    f"the reply `{head}` ends at its first `{mark}`, the separator; shorten it", *loc
                )


class BinaryProtocol(Model):
    """Requests and replies as bytes. A reply has no frame: what arrives before a request is thrown away."""

    kind: Literal["binary"] = Field(description="Bytes.")
    byte_order: Literal["little", "big"] = Field("little", description="Of numbers of several bytes.")
    reply_timeout: ReplyTimeout = 0.2
    set_speed: BinarySpeedCommand = Field(
        description="Sets both wheel speeds; with zeros it stops the robot."
    )
    identify: BinaryIdentify | None = Field(
        None, description="Requests the firmware version, of a robot that takes text as well."
    )
    setup: Annotated[tuple[BinaryExchange, ...], Field(max_length=_MOST, strict=False)] = Field(
        (),
        examples=[[{"send": "f1 01 00", "reply": "b"}]],
        description="Requests sent once after each connection, before the first reading, such as to "
        "switch its sensors on.",
    )
    queries: Mapping[QueryName, BinaryQuery] = Field(
        default_factory=dict,
        examples=[{"position": {"send": "af 00", "reply": "2h"}}],
        description="Other requests, by name; `sensors` gives the meaning of the numbers in the replies.",
    )


class PythonProtocol(Model):
    """A protocol in Python: a class in a file beside the type's makes the requests and reads the replies."""

    kind: Literal["python"] = Field(description="A class of your own.")
    codec: ClassName = Field(
        description="The class, in the file that is called as the type's, with .py: robots/beetle.py."
    )
    options: Mapping[QueryName, Value] = Field(
        default_factory=dict, examples=[{"address": 3}], description="Passed to the class when it is created."
    )
    reply_timeout: ReplyTimeout = 0.2
    identify: bool = Field(False, description="Whether the class can request the firmware version.")
    set_speed: CodedExchange = Field(description="Sets both wheel speeds; with zeros it stops the robot.")
    queries: Mapping[QueryName, CodedQuery] = Field(
        default_factory=dict,
        examples=[{"position": {"values": 2, "request": 4, "reply": 16}}],
        description="Other requests, by name; `sensors` gives the meaning of the numbers in the replies.",
    )


class SketchOdometry(Model):
    """The topics on which a sketch publishes wheel counts: whole numbers that grow forward and wrap."""

    left: GraphName = Field(examples=["lwheel"], description="The topic that counts for the left wheel.")
    right: GraphName = Field(examples=["rwheel"], description="The topic that counts for the right wheel.")
    counts_per_turn: float = Field(gt=0, examples=[20], description="How far one turn of a wheel counts.")


class RosserialProtocol(Model):
    """A sketch that speaks rosserial. It declares its topics itself; the robot's driver publishes and
    subscribes to them in the robot's namespace.
    """

    kind: Literal["rosserial"] = Field(description="rosserial, of ROS hydro to noetic.")
    board: Name = Field(examples=["arduino-uno"], description="The microcontroller that the sketch runs on.")
    firmware: Literal["uno-l298n"] | None = Field(
        None,
        description="A sketch that swarmctl writes, builds and flashes for each robot (`settings.firmware`). "
        "It publishes the pulses of the left wheel, then of the right. Without it the sketch is yours.",
    )
    firmware_timeout: Annotated[float, Unit("s")] = Field(
        ge=0.05,
        le=2,
        examples=[0.4],
        description="Time without a command after which the sketch stops the robot; nothing else does.",
    )
    publishes: Annotated[tuple[Topic, ...], Field(strict=False)] = Field(
        (),
        examples=[[{"topic": "lwheel", "type": "std_msgs/Int32", "rate": 10.0}]],
        description="Topics that the sketch publishes, in its order, each with its rate.",
    )
    subscribes: Annotated[tuple[Topic, ...], Field(strict=False)] = Field(
        examples=[[{"topic": "cmd_vel", "type": "geometry_msgs/Twist"}]],
        description="Topics that the sketch subscribes to; `cmd_vel` is one of them.",
    )

    odometry: SketchOdometry | None = Field(
        None,
        examples=[{"left": "lwheel", "right": "rwheel", "counts_per_turn": 20}],
        description="The topics of `publishes` that the driver makes `odom` from; needs `wheel_radius`.",
    )

    @fits_together
    def _is_a_robots(self) -> Iterator[ConsistencyError]:
        named = ("publishes", self.publishes), ("subscribes", self.subscribes)
        for key, index, one in [(key, *each) for key, topics in named for each in enumerate(topics)]:
            if not one.topic[0].isalpha() or "/" in one.topic:
                yield ConsistencyError(
                    f"`{one.topic}` is not a name within a robot's namespace; write one word, like `lwheel`",
                    key, index, "topic",
                )  # fmt: skip
        for index, one in enumerate(self.publishes):
            if one.rate is None:
                yield ConsistencyError(
                    f"`rate` of `{one.topic}` is missing; add how often the sketch publishes it, Hz",
                    "publishes",
                    index,
                )
        if ("cmd_vel", "geometry_msgs/Twist") not in ((one.topic, one.type) for one in self.subscribes):
            yield ConsistencyError(
                "`subscribes` has no `cmd_vel`; add {topic: cmd_vel, type: geometry_msgs/Twist}",
                "subscribes",
            )
        if self.firmware and all(one.rate is not None for one in self.publishes):
            yield from self._is_ours()

    def _is_ours(self) -> Iterator[ConsistencyError]:
        """Checks board and topics against swarmctl's own sketch."""
        if self.board not in UNO_BOARDS:
            yield ConsistencyError(f"the sketch `{self.firmware}` is for {' and '.join(UNO_BOARDS)}", "board")
        if [one.type for one in self.publishes] != ["std_msgs/Int32"] * 2 or len(self.subscribes) != 1:
            yield ConsistencyError(
                f"the sketch `{self.firmware}` publishes two std_msgs/Int32, the pulses of the left and of "
                "the right wheel, and subscribes only to `cmd_vel`",
                "subscribes" if len(self.subscribes) != 1 else "publishes",
            )
        elif len({one.rate for one in self.publishes}) > 1:
            yield ConsistencyError(
                f"the sketch `{self.firmware}` publishes both wheels' pulses at one rate",
                "publishes",
                1,
                "rate",
            )
        elif not 1 <= (self.publishes[0].rate or 0) <= 100:
            yield ConsistencyError(
                f"the sketch `{self.firmware}` publishes 1 to 100 times a second", "publishes", 0, "rate"
            )

    @fits_together
    def _counts_what_it_publishes(self) -> Iterator[ConsistencyError]:
        published = {one.topic: one.type for one in self.publishes}
        if self.odometry is not None and self.odometry.left == self.odometry.right:
            yield ConsistencyError(
                f"`{self.odometry.right}` counts for both wheels; name the topic of the right wheel",
                "odometry", "right",
            )  # fmt: skip
        for side in ("left", "right") if self.odometry else ():
            topic = getattr(self.odometry, side)
            if published.get(topic) not in COUNTERS:
                yield ConsistencyError(
                    f"`odometry` counts on `{topic}`: add it to `publishes`, as {' or '.join(COUNTERS)}",
                    "odometry", side,
                )  # fmt: skip


#: What odometry can be made from.
COUNTERS = ("std_msgs/Int16", "std_msgs/Int32")

#: A protocol in which swarmctl's driver sends requests and the robot replies.
DriverProtocol = LineProtocol | BinaryProtocol | PythonProtocol
Protocol = Annotated[
    LineProtocol | BinaryProtocol | PythonProtocol | RosserialProtocol, Field(discriminator="kind")
]
PROTOCOLS: dict[str, type[Model]] = {
    "line": LineProtocol, "binary": BinaryProtocol, "python": PythonProtocol,
    "rosserial": RosserialProtocol,
}  # fmt: skip


def length_of(protocol: DriverProtocol, query: str, digits: int) -> tuple[int, int]:
    """Returns the bytes of a query and of its longest reply, whose numbers have ``digits`` characters."""
    if isinstance(protocol, LineProtocol):
        return protocol.queries[query].length(digits, len(protocol.separator))
    return protocol.queries[query].length(digits)
