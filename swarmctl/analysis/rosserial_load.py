"""The topics of a sketch beside the limits of its board: slots, buffers and the serial line. Pure numbers.

The limits are those of rosserial's node_handle.h (noetic): an outgoing frame is built in the output buffer
with eight bytes around the message; of an incoming frame only the message is stored, and it must be complete
20 ms after its first byte (swarmctl's own sketch waits longer). Time, log and parameters take no slots.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from swarmctl.analysis import sketch_limits
from swarmctl.robot_types.protocols import RosserialProtocol
from swarmctl.robot_types.ros_launchable import Topic
from swarmctl.robot_types.sketch_settings import Board, boards, size_of
from swarmctl.spec.program_model import Program
from swarmctl.swarm.index import SwarmIndex
from swarmctl.yamltext.source import Loc

BAUD = 57600  # of both ends, unless ~baud says otherwise
FRAMING = (
    8  # two sync bytes, length, its checksum, topic id, checksum (ROS wiki, rosserial/Overview/Protocol)
)
PATIENCE = 0.02  # s that a board waits for the rest of a frame
_BITS = 10  # a byte takes on the line: 8N1
_INFO = 50  # bytes of a topic's announcement beside its name and type: id, lengths, MD5 sum, buffer size


@dataclass(frozen=True)
class Carried:
    """One topic of a sketch. ``bytes`` is None if neither its type nor the spec defines its size."""

    key: str  # publishes or subscribes
    index: int
    topic: Topic
    bytes: int | None

    @property
    def sent(self) -> bool:
        """True if the board publishes it, False if the board subscribes to it."""
        return self.key == "publishes"

    @property
    def announcement(self) -> int:
        """Bytes of the frame in which the board announces the topic."""
        return FRAMING + _INFO + len(self.topic.topic) + len(self.topic.type)


@dataclass(frozen=True)
class RosserialBudget:
    """The topics of a program's or a robot's board beside its limits.

    ``loc`` is where the spec declares them, ``patience`` how long the board waits for the rest of a frame, s.
    """

    kind: str  # program or robot
    owner: str
    loc: Loc
    name: str
    board: Board
    baud: int
    topics: tuple[Carried, ...]
    patience: float = PATIENCE

    @property
    def published(self) -> int:
        """The number of topics that the board publishes."""
        return sum(one.sent for one in self.topics)

    @property
    def subscribed(self) -> int:
        """The number of topics to which the board subscribes."""
        return len(self.topics) - self.published

    def largest_message(self, carried: Carried) -> int:
        """Bytes of the largest message of that direction."""
        return self.board.sends - FRAMING if carried.sent else self.board.receives

    def seconds(self, carried: Carried) -> float:
        """Seconds that one message takes on the line."""
        return (carried.bytes or 0) * _BITS / self.baud + FRAMING * _BITS / self.baud

    @property
    def available(self) -> float:
        """Bytes a second, each way."""
        return self.baud / _BITS

    @property
    def needed(self) -> float:
        """Bytes a second in the busier direction, of topics with a known rate and size."""
        directions = {True: 0.0, False: 0.0}
        for one in self.topics:
            if one.topic.rate is not None and one.bytes is not None:
                directions[one.sent] += one.topic.rate * (one.bytes + FRAMING)
        return max(directions.values())

    @property
    def share(self) -> float:
        """The used share of the busier direction; above 1 it is overloaded."""
        return self.needed / self.available

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            self.kind: self.owner,
            "board": self.name,
            "baud": self.baud,
            "publishers": [self.published, self.board.publishers],
            "subscribers": [self.subscribed, self.board.subscribers],
            "largest_sent": [self._largest(True), self.board.sends - FRAMING],
            "largest_received": [self._largest(False), self.board.receives],
            "bytes_per_second": round(self.needed, 1),
            "bytes_per_second_available": round(self.available, 1),
            "share": round(self.share, 3),
        }

    def _largest(self, sent: bool) -> int:
        return max((one.bytes or 0 for one in self.topics if one.sent is sent), default=0)


def rosserial_budgets(index: SwarmIndex) -> Iterator[RosserialBudget]:
    """Yields the budget of every known board: of programs, then of robots whose type declares a sketch."""
    spec = index.spec
    for name, program in spec.programs.items():
        if program.board in boards():
            yield program_budget(name, program)
    for _, link, robot_type in index.native_lines:
        if robot_type.sketch is not None and robot_type.sketch.board in boards():
            kind = spec.robots[link.robot].type
            loc = ("types", kind, "protocol") if kind in spec.types else ("robots", link.robot, "type")
            yield _budget("robot", link.robot, loc, link.own_baud or robot_type.link.baud, robot_type.sketch)


def program_budget(name: str, program: Program) -> RosserialBudget:
    """Returns the budget of the board that ``program`` talks to."""
    given = program.params.get("baud", BAUD)
    baud = given if isinstance(given, int) and given > 0 else BAUD
    return _budget("program", name, ("programs", name), baud, program)


def _budget(
    kind: str, owner: str, loc: Loc, baud: int, sketch: Program | RosserialProtocol
) -> RosserialBudget:
    name = sketch.board or ""
    ours = isinstance(sketch, RosserialProtocol) and sketch.firmware is not None
    waits = sketch_limits.patience(baud) if ours else PATIENCE
    return RosserialBudget(kind, owner, loc, name, boards()[name], baud, tuple(_carried(sketch)), waits)


def _carried(sketch: Program | RosserialProtocol) -> Iterator[Carried]:
    for key, topics in (("publishes", sketch.publishes), ("subscribes", sketch.subscribes)):
        for index, topic in enumerate(topics):
            yield Carried(key, index, topic, message_bytes(topic.type, topic.size))


def message_bytes(type_name: str, declared: int | None) -> int | None:
    """Bytes of a message: as declared, else computed from its type; None if the type has no fixed size."""
    if declared is not None:
        return declared
    size = size_of(type_name)
    return None if size is None or size.open else size.bytes
