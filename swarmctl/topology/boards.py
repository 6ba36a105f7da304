"""Whether a sketch's topics fit into its board: places, buffers and rosserial's serial line. Pure numbers.

What is counted is in rosserial's node_handle.h (noetic): an outgoing frame is built in the output buffer with
its eight bytes around the message; of an incoming one only the message itself is kept, and it must be there
20 ms after its first byte (swarmctl's own sketch waits longer). Time, log and parameters take no places.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from swarmctl.spec.boards import Board, boards
from swarmctl.spec.messages import size_of
from swarmctl.spec.model import Bluetooth, Program, Serial, Spec
from swarmctl.spec.protocols import RosserialProtocol
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.source import Loc
from swarmctl.spec.topics import Topic
from swarmctl.topology import sketches

BAUD = 57600  # of both ends, unless ~baud says otherwise
FRAMING = (
    8  # two sync bytes, length, its checksum, topic id, checksum (ROS wiki, rosserial/Overview/Protocol)
)
PATIENCE = 0.02  # s that a board waits for the rest of a frame
CAREFUL = 0.7  # share of the line above which frames queue up
_BITS = 10  # a byte takes on the line: 8N1
_INFO = 50  # bytes of a topic's announcement beside its name and type: id, lengths, MD5 sum, buffer size


@dataclass(frozen=True)
class Carried:
    """One topic of a sketch. ``bytes`` is nothing where neither its type nor the spec says its size."""

    key: str  # publishes or subscribes
    index: int
    topic: Topic
    bytes: int | None

    @property
    def sent(self) -> bool:
        return self.key == "publishes"

    @property
    def announcement(self) -> int:
        """Bytes of the frame in which the board names the topic."""
        return FRAMING + _INFO + len(self.topic.topic) + len(self.topic.type)


@dataclass(frozen=True)
class BoardBudget:
    """What the board of a program, or of a robot, has to hold and to say. ``loc`` is where that stands;
    ``patience`` how long it waits for the rest of a frame, s.
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
        return sum(one.sent for one in self.topics)

    @property
    def subscribed(self) -> int:
        return len(self.topics) - self.published

    def room(self, carried: Carried) -> int:
        """The largest message that passes, bytes."""
        return self.board.sends - FRAMING if carried.sent else self.board.receives

    def seconds(self, carried: Carried) -> float:
        """How long one message takes on the line."""
        return (carried.bytes or 0) * _BITS / self.baud + FRAMING * _BITS / self.baud

    @property
    def available(self) -> float:
        """Bytes a second, each way."""
        return self.baud / _BITS

    @property
    def needed(self) -> float:
        """Bytes a second in the busier direction, of the topics whose rate and size are known."""
        ways = {True: 0.0, False: 0.0}
        for one in self.topics:
            if one.topic.rate is not None and one.bytes is not None:
                ways[one.sent] += one.topic.rate * (one.bytes + FRAMING)
        return max(ways.values())

    @property
    def share(self) -> float:
        return self.needed / self.available

    def to_json(self) -> dict[str, object]:
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


def board_budgets(spec: Spec, types: Mapping[str, RobotType]) -> Iterator[BoardBudget]:
    """Every board that is known: of programs, then of robots, whose type says what their sketch does."""
    for name, program in spec.programs.items():
        if program.board in boards():
            yield program_budget(name, program)
    known = {name: one.sketch for name, one in types.items() if one.sketch is not None}
    for link in spec.links if known else ():
        kind = spec.robots[link.robot].type if isinstance(link, (Serial, Bluetooth)) else ""
        if isinstance(link, (Serial, Bluetooth)) and kind in known and known[kind].board in boards():
            own = link.baud if isinstance(link, Serial) else None
            loc = ("types", kind, "protocol") if kind in spec.types else ("robots", link.robot, "type")
            baud = own or types[kind].link.baud
            yield _budget("robot", link.robot, loc, baud, known[kind])


def program_budget(name: str, program: Program) -> BoardBudget:
    """The budget of the board that ``program`` speaks with."""
    said = program.params.get("baud", BAUD)
    baud = said if isinstance(said, int) and said > 0 else BAUD
    return _budget("program", name, ("programs", name), baud, program)


def _budget(kind: str, owner: str, loc: Loc, baud: int, said: Program | RosserialProtocol) -> BoardBudget:
    name = said.board or ""
    ours = isinstance(said, RosserialProtocol) and said.firmware is not None
    waits = sketches.patience(baud) if ours else PATIENCE
    return BoardBudget(kind, owner, loc, name, boards()[name], baud, tuple(_carried(said)), waits)


def _carried(said: Program | RosserialProtocol) -> Iterator[Carried]:
    for key, topics in (("publishes", said.publishes), ("subscribes", said.subscribes)):
        for index, topic in enumerate(topics):
            yield Carried(key, index, topic, message_bytes(topic.type, topic.size))


def message_bytes(type_name: str, said: int | None) -> int | None:
    """Bytes of a message: what the spec says, else what its type makes of itself; nothing if it is open."""
    if said is not None:
        return said
    size = size_of(type_name)
    return None if size is None or size.open else size.bytes
