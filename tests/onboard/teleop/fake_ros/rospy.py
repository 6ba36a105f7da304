"""As much of rospy as teleop touches, without a master. What happens stands in the folder $FAKE_ROS.

Publications go to its file ``published``, one JSON object a line; Joy messages come from its pipe ``joy``.
A file ``restarted`` there is a master that knows no node until one joins, ``kicked`` one that ends the node,
``away`` one that does not answer; ``failing`` is a bug in publishing whatever moves a robot.
"""

from __future__ import annotations

import json
import os
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

_FOLDER = Path(os.environ["FAKE_ROS"])
_LOCK = threading.Lock()
_HOOKS: list[Any] = []
_state = SimpleNamespace(name="", closed=False)


class ROSException(Exception):  # noqa: N818  its name in rospy
    """Such as: publish() to a closed topic."""


def _record(**news: Any) -> None:
    with _LOCK, (_FOLDER / "published").open("a") as file:
        file.write(json.dumps({"at": time.monotonic(), "pid": os.getpid(), **news}) + "\n")


class Time:
    """The time of ROS."""

    now = staticmethod(time.time)


def init_node(name: str, disable_signals: bool) -> None:
    assert disable_signals
    while (_FOLDER / "away").exists():
        (_FOLDER / "joining").touch()
        time.sleep(0.05)
    (_FOLDER / "restarted").unlink(missing_ok=True)
    _state.name = f"{os.environ['ROS_NAMESPACE'].rstrip('/')}/{name}"
    _record(node=_state.name)
    threading.Thread(target=_until_kicked, daemon=True).start()


def _until_kicked() -> None:
    while not (_FOLDER / "kicked").exists():
        time.sleep(0.02)
    signal_shutdown("new node registered with same name")


def on_shutdown(hook: Any) -> None:
    _HOOKS.append(hook)


def signal_shutdown(reason: str) -> None:
    for hook in _HOOKS:
        hook()
    _HOOKS.clear()
    _state.closed = True
    _record(shutdown=reason)


def get_name() -> str:
    return _state.name


class SubscribeListener:
    """Teleop greets nobody."""


class Publisher:
    def __init__(
        self,
        topic: str,
        kind: Any,
        *,
        queue_size: int,
        tcp_nodelay: bool,
        latch: bool,
        subscriber_listener: None,
    ) -> None:
        assert (queue_size, tcp_nodelay, latch) == (1, True, False)
        self._topic, self._kind = topic, kind

    def publish(self, message: Any) -> None:
        if _state.closed:
            raise ROSException("publish() to a closed topic")
        assert type(message) is self._kind  # rospy refuses any other
        twist = getattr(message, "twist", message)
        if (_FOLDER / "failing").exists() and twist.linear.x:
            raise RuntimeError("a bug")
        stamped = message is not twist and message.header.stamp > 0
        _record(topic=self._topic, linear=twist.linear.x, angular=twist.angular.z, stamped=stamped)


class Subscriber:
    def __init__(self, topic: str, _type: Any, take: Any, **_: Any) -> None:
        self._take = take
        _record(subscribes=topic)
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        with (_FOLDER / "joy").open() as lines:
            for line in lines:
                self._take(SimpleNamespace(**json.loads(line)))
