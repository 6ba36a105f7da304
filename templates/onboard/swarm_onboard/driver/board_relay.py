"""A board's topics in ROS, whatever their types.

Registering with a master may take for ever, so a thread of its own does it, one topic after the other.
"""

from __future__ import annotations

import threading
from queue import SimpleQueue
from typing import Any, Callable, Sequence

from swarm_onboard.driver.relay import Mailbox, Outgoing, Parameter
from swarm_onboard.ros.node import Node, md5sum_and_least
from swarm_onboard.rosserial.topics import MessageType, Topic

_ERROR = 3  # of rosserial_msgs/Log


class BoardRelay:
    """Knows types at once, and forwards messages once ``join`` was called."""

    def __init__(self, mailbox: Mailbox) -> None:
        self.taken = mailbox.taken
        self._mailbox = mailbox
        self._wanted: tuple[Topic, ...] = ()
        self._served: dict[Topic, Any] = {}  # publishers and subscriptions
        self._node: Node | None = None
        self._errands: SimpleQueue[Callable[[Node], None]] = SimpleQueue()

    def type_of(self, name: str) -> MessageType | None:
        known = md5sum_and_least(name)
        return MessageType(*known) if known is not None else None

    def join(self, node: Node) -> None:
        """Starts forwarding."""
        self._node = node
        threading.Thread(target=self._run_errands, args=(node,), name="board-topics", daemon=True).start()
        self._errands.put(self._reconcile)

    def serve(self, topics: Sequence[Topic]) -> None:
        self._wanted = tuple(topics)
        self._errands.put(self._reconcile)

    def publish(self, topic: Topic, message: bytes) -> None:
        publisher = self._served.get(topic)
        if publisher is not None:
            publisher.publish(message)

    def log(self, level: int, text: str) -> None:
        text = f"the sketch says: {text}"
        if self._node is None:
            print(text, flush=True)
        else:
            self._node.log(level, text)

    def ask(self, name: str) -> None:
        self._errands.put(lambda node: self._find(node, name))

    def _run_errands(self, node: Node) -> None:
        while True:
            self._errands.get()(node)

    def _reconcile(self, node: Node) -> None:
        wanted = self._wanted
        for topic in [one for one in self._served if one not in wanted]:
            self._served.pop(topic).close()
        for topic in wanted:
            if topic not in self._served:
                try:
                    self._served[topic] = self._registered(node, topic)
                except ValueError as error:  # a name that is none
                    node.log(_ERROR, f"topic `{topic.name}` of the sketch: {error}")

    def _registered(self, node: Node, topic: Topic) -> Any:
        if topic.published:
            return node.board_publisher(topic.name, topic.type)
        return node.board_subscription(
            topic.name, topic.type, lambda message: self._mailbox.put(Outgoing(topic.name, message))
        )

    def _find(self, node: Node, name: str) -> None:
        try:
            self._mailbox.put(Parameter(name, node.parameter(name)))
        except KeyError:
            node.log(_ERROR, f"the sketch asks for the parameter `{name}`, which nobody has set")
        except Exception as error:  # noqa: BLE001  a master that is away; the sketch asks again if it cares
            node.log(_ERROR, f"the parameter `{name}` that the sketch asks for: {error}")
