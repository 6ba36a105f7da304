"""A node of ROS as the programs here use it, and the one place that chooses between ROS 1 and ROS 2."""

from __future__ import annotations

import os
import sys
from enum import Enum
from importlib import import_module
from typing import Any, Callable, Mapping, Optional, Protocol, Sequence


class Kind(Enum):
    """How messages travel. ROS 1 has one way; in ROS 2 both ends of a topic must agree."""

    SENSOR = "best effort: the next reading replaces one that was lost"
    STATE = "reliable: odometry, transforms, diagnostics"
    COMMAND = "reliable, and dropped once it is too old to move a robot"
    LATCHED = "reliable, and kept for later subscribers"


class Publisher(Protocol):
    """A topic that this node publishes."""

    def publish(self, message: Any) -> None:
        """Publishes a message; does nothing once ROS has ended this node."""

    def listeners(self) -> int:
        """Returns how many subscribers are connected."""

    def close(self) -> None:
        """Ends it."""


class Subscription(Protocol):
    """A topic to which this node subscribes."""

    def close(self) -> None:
        """Ends it."""


COMMAND_TYPES = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")


class TakeCommand(Protocol):
    """Passes on a command."""

    def __call__(
        self,
        node: str,
        host: str | None,
        linear: Sequence[float],
        angular: Sequence[float],
        arrived: float,
        *,
        age: float,
    ) -> None:
        """Takes the sender's node and host (None: not known yet), m/s, rad/s, and when it arrived.

        ``age``: how old it was then by its stamp, s; 0 without one, negative for one of the future.
        """


#: Passes on a message: the sender's node and host, the message.
TakeSetting = Callable[[str, Optional[str], Any], None]


class Node(Protocol):
    """A node that is part of the graph."""

    @property
    def name(self) -> str:
        """Its full name."""

    def now(self) -> Any:
        """Returns the time for the header of a message."""

    def octets(self, data: bytes) -> Any:
        """Returns bytes as messages hold them in a field of type uint8[]."""

    def publisher(
        self, topic: str, message: Any, kind: Kind, greet: Callable[[], None] | None = None
    ) -> Publisher:
        """Publishes ``topic``; ``message`` is its class. ``greet`` is called for each new subscriber."""

    def subscribe(self, topic: str, message: Any, take: Callable[[Any], None], kind: Kind) -> Subscription:
        """Passes each message on ``topic`` to ``take``, in a thread of ROS."""

    def subscribe_to_commands(self, topic: str, kind: str, take: TakeCommand) -> None:
        """Passes each command on ``topic``, of the type named ``kind``, to ``take``, but not those that a
        publisher repeats to whoever connects, or that a network held up."""

    def subscribe_to_settings(self, topic: str, message: Any, take: TakeSetting) -> None:
        """Passes each message on ``topic``, of class ``message``, to ``take``."""

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Shows the mapping ``values`` as the parameters of this node. Raises any error."""

    def describe(self, urdf: str) -> None:
        """Shows a robot's description to the nodes of its namespace. Raises any error."""

    def parameter(self, name: str) -> Any:
        """Returns a parameter. Raises KeyError if nobody has set it, any error if it cannot be read."""

    def log(self, level: int, text: str) -> None:
        """Logs a text: 0 debug, 1 info, 2 warning, 3 error, 4 fatal."""

    def publishers_and_subscribers(self, topics: Sequence[str]) -> dict[str, tuple[list[str], list[str]]]:
        """Returns the nodes at both ends of each topic, by full names. Raises any error without a graph."""

    def has_ended(self, node: str) -> bool:
        """Returns True if the process of ``node`` has ended, though the graph may still list it."""

    def is_forgotten(self) -> bool:
        """Returns True if the graph has lost this node for good: a master was restarted.

        A node that joined for good takes back the name that somebody else has taken.
        """

    def board_publisher(self, topic: str, kind: str) -> Publisher:
        """Publishes ``topic`` of the type named ``kind`` from bytes of ROS 1."""

    def board_subscription(self, topic: str, kind: str, take: Callable[[bytes], None]) -> Subscription:
        """Passes each message on ``topic`` to ``take`` as bytes of ROS 1."""

    def leave(self) -> None:
        """Leaves the graph; a graph that does not answer is not waited for."""


def join(name: str, namespace: str, end: Callable[[], None]) -> Node:
    """Becomes the node ``name``. Returns when the graph knows it, however long that takes.

    ``end`` is called when ROS shuts the node down, before it closes the connections.
    """
    os.environ["ROS_NAMESPACE"] = namespace or "/"  # rospy reads it when it is imported
    joined: Node = _face("node").join(name, namespace, end)
    return joined


def join_for_good(name: str, namespace: str, end: Callable[[], None]) -> Node:
    """Becomes the node ``name``, which moves a robot: nobody in ROS ends it, or takes its name for long.

    ``end`` is called when ROS itself fails in this process. Else as ``join``.
    """
    os.environ["ROS_NAMESPACE"] = namespace or "/"
    joined: Node = _face("node").join_for_good(name, namespace, end)
    return joined


def leave_out_numpy() -> None:
    """Saves 14 MB and 0.1 s in ROS 1, for a node whose messages have no lists of numbers.

    Where there is numpy, genpy/message.py imports it. None makes that an ImportError, which genpy expects.
    """
    if _package() == "ros1":
        sys.modules["numpy"] = None  # type: ignore[assignment]


def md5sum_and_least(name: str) -> tuple[str, int] | None:
    """Returns what ROS 1 knows of a message type: its MD5 sum, and the size of its smallest message, bytes.

    None if no package of this host has it.
    """
    known: tuple[str, int] | None = _face("board_types").md5sum_and_least(name)
    return known


def message_class(name: str) -> Any:
    """Returns the class of a message type such as ``std_msgs/String``; None if this host has none."""
    return _face("board_types").message_class(name)


def _face(module: str) -> Any:
    return import_module(f"swarm_onboard.{_package()}.{module}")


def _package() -> str:
    """The face of the ROS whose environment this process has: its setup files set ROS_VERSION."""
    return "ros2" if os.environ.get("ROS_VERSION") == "2" else "ros1"
