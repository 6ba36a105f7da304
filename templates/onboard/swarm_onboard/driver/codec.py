"""How requests and replies are encoded on one kind of line. Pure: values to bytes, bytes to values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Callable, Protocol, Sequence, Tuple, Union

if TYPE_CHECKING:
    from swarm_onboard.driver.config import Actuator

Number = Union[int, float]
Values = Tuple[Number, ...]


class BadReplyError(Exception):
    """The robot answered, but refused the request or garbled the reply."""


@dataclass(frozen=True)
class Reply:
    """A good reply: its numbers, and its text where it has one."""

    values: Values = ()
    text: str = ""


class Reader(Protocol):
    """Takes the answer to one request as it arrives. ``noise`` counts unsolicited lines."""

    noise: int
    stray: str  # what an unsolicited line means, as text for people; empty if none arrived

    def feed(self, data: bytes) -> Reply | None:
        """Returns the reply once ``data`` completes it, else None. Raises ``BadReplyError``."""
        ...


@dataclass(frozen=True)
class Request:
    """What is sent, how people call it, and who reads the answer.

    ``answered`` is false where none comes; ``framed`` where an answer shows whose it is; ``urgent`` is what
    waits for nothing; ``trails`` where more follows the answer.
    """

    data: bytes
    name: str
    reader: Callable[[], Reader]
    answered: bool = True
    framed: bool = True
    urgent: bool = False
    trails: bool = False


class Codec(Protocol):
    """One kind of line. Every request is ready to be sent as it is."""

    def speed(self, left: int, right: int) -> Request:
        """Returns the request that sets both wheel speeds, in the robot's units."""
        ...

    def query(self, name: str) -> Request:
        """Returns the request that the robot type calls ``name``."""
        ...

    def actuator(self, actuator: Actuator, index: int, values: Sequence[int]) -> Request:
        """Returns the request that sets the channel ``index`` of an actuator, or all channels."""
        ...

    def setup(self) -> list[Request]:
        """Returns the requests that prepare the robot, in the order in which they are sent."""
        ...

    def identify(self) -> Request | None:
        """Returns the request for the firmware version; None if the robot has none."""
        ...
