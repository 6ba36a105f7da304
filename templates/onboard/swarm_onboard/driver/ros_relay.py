"""A board's topics in ROS 1, whatever their types: bytes pass unchanged.

Registering with a master may take for ever, so a thread of its own does it, one topic after the other.
"""

from __future__ import annotations

import io
import re
import threading
from queue import SimpleQueue
from typing import Any, Callable, Sequence

from swarm_onboard.driver.relay import Mailbox, Outgoing, Parameter
from swarm_onboard.rosserial.topics import MessageType, Topic

_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*", re.ASCII)


class RosRelay:
    """Knows types at once, and forwards messages once ``join`` was called."""

    def __init__(self, mailbox: Mailbox) -> None:
        self.taken = mailbox.taken
        self._mailbox = mailbox
        self._classes: dict[str, Any] = {}
        self._wanted: tuple[Topic, ...] = ()
        self._served: dict[Topic, Any] = {}  # publishers and subscribers of rospy
        self._rospy: Any = None
        self._errands: SimpleQueue[Callable[[], None]] = SimpleQueue()

    def type_of(self, name: str) -> MessageType | None:
        message = self._class(name)
        if message is None:
            return None
        smallest = io.BytesIO()
        message().serialize(smallest)
        return MessageType(message._md5sum, len(smallest.getvalue()))

    def join(self) -> None:
        """Starts forwarding: this process is now a ROS node."""
        import rospy  # noqa: PLC0415  importing ROS takes longer than stopping the robot

        self._rospy = rospy
        threading.Thread(target=self._run_errands, name="board-topics", daemon=True).start()
        self._errands.put(self._reconcile)

    def serve(self, topics: Sequence[Topic]) -> None:
        self._wanted = tuple(topics)
        self._errands.put(self._reconcile)

    def publish(self, topic: Topic, message: bytes) -> None:
        publisher = self._served.get(topic)
        if publisher is not None:
            raw = publisher.data_class()
            raw._buff = message
            publisher.publish(raw)

    def log(self, level: int, text: str) -> None:
        rospy = self._rospy
        if rospy is None:
            print(f"the sketch says: {text}", flush=True)
            return
        says = (rospy.logdebug, rospy.loginfo, rospy.logwarn, rospy.logerr, rospy.logfatal)
        says[min(level, len(says) - 1)]("the sketch says: %s", text)

    def ask(self, name: str) -> None:
        self._errands.put(lambda: self._find(name))

    def _run_errands(self) -> None:
        while True:
            self._errands.get()()

    def _reconcile(self) -> None:
        wanted = self._wanted
        for topic in [one for one in self._served if one not in wanted]:
            self._served.pop(topic).unregister()
        for topic in wanted:
            if topic not in self._served:
                try:
                    self._served[topic] = self._registered(topic)
                except ValueError as error:  # rospy's word for a name that is none
                    self._rospy.logerr("topic `%s` of the sketch: %s", topic.name, error)

    def _registered(self, topic: Topic) -> Any:
        raw = _raw(self._rospy, self._class(topic.type))
        if topic.published:
            return self._rospy.Publisher(topic.name, raw, queue_size=10)

        def take(message: Any) -> None:
            self._mailbox.put(Outgoing(topic.name, message._buff))

        return self._rospy.Subscriber(topic.name, raw, take, queue_size=10)

    def _find(self, name: str) -> None:
        try:
            self._mailbox.put(Parameter(name, self._rospy.get_param(name)))
        except KeyError:
            self._rospy.logerr("the sketch asks for the parameter `%s`, which nobody has set", name)
        except Exception as error:  # noqa: BLE001  a master that is away; the sketch asks again if it cares
            self._rospy.logerr("the parameter `%s` that the sketch asks for: %s", name, error)

    def _class(self, name: str) -> Any:
        if name not in self._classes:
            self._classes[name] = _message_class(name)
        return self._classes[name]


def _message_class(name: str) -> Any:
    """Returns the class of a message type in the packages of this host; None if there is none."""
    if not _TYPE.fullmatch(name):
        return None
    from roslib.message import get_message_class  # noqa: PLC0415  not every driver needs it

    try:
        return get_message_class(name)
    except Exception:  # noqa: BLE001  whatever is wrong with a package, it has no such type for us
        return None


def _raw(rospy: Any, message: Any) -> Any:
    """Returns a class for the bytes of ``message``, which other nodes cannot distinguish from it."""
    return type(
        message.__name__,
        (rospy.AnyMsg,),
        {"_type": message._type, "_md5sum": message._md5sum, "_full_text": message._full_text},
    )
