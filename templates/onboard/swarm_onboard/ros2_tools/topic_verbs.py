"""What ``swarmctl topic`` does on a host, by rclpy, as ``ros2 topic`` does it."""

from __future__ import annotations

import math
import os
import sys
import time
from collections import deque
from typing import Any, Callable, Iterator, Mapping, Sequence

import yaml
from rclpy.clock import Clock
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from swarm_onboard.ros2.quality import quality_of
from swarm_onboard.ros2_probe.discovery import BOUND, QUIET
from swarm_onboard.ros2_probe.endpoints import HIDDEN
from swarm_onboard.ros2_probe.listening import message_class
from swarm_onboard.ros2_probe.look import joined
from swarm_onboard.ros2_tools.message_yaml import filled, text

_NAME = f"{HIDDEN}swarm_topic_"
_LOOK_EVERY = 0.5  # s
_TURN = 0.1  # s of receiving after which a signal ends the program
_DEPTH = 100  # messages that wait while others are printed
_WINDOW = 10000  # messages of a rate, as of `ros2 topic hz`
_USUAL_RATE = 1.0  # Hz, as of `ros2 topic pub`
_MATCHES = 10.0  # s within which a subscription is found
_BOTH = 0.5  # s until the other side has found us, too
_ARRIVES = 3.0  # s


def run(words: Sequence[str]) -> None:
    """Runs the verb of ``words`` as a hidden node, which has left the graph at the end. Raises any error."""
    verb, *rest = words
    with joined(f"{_NAME}{os.getpid()}") as node:
        _VERBS[verb](node, *rest)


def _list(node: Any, _verbose: str) -> None:
    began = changed = now = time.monotonic()
    lines: list[str] = []
    while now - changed < QUIET and now - began < BOUND:
        time.sleep(_LOOK_EVERY)
        before, lines, now = lines, list(_lines(node)), time.monotonic()
        if lines != before:
            changed = now
    print(*lines, sep="\n", flush=True)


def _lines(node: Any) -> Iterator[str]:
    """A line for the publishers of each topic, and one for its subscribers, without what is hidden."""
    for topic, _ in node.get_topic_names_and_types():
        if f"/{HIDDEN}" in topic:
            continue
        found = {
            "publisher": node.get_publishers_info_by_topic(topic),
            "subscriber": node.get_subscriptions_info_by_topic(topic),
        }
        kinds = {
            role: [one.topic_type for one in ends if not one.node_name.startswith(HIDDEN)]
            for role, ends in found.items()
        }
        named = ", ".join(sorted({one for each in kinds.values() for one in each}))
        yield from (f" * {topic} [{named}] {len(each)} {role}s" for role, each in kinds.items() if each)


def _echo(node: Any, topic: str) -> None:
    receiver = _Receiver(node, topic, _print)
    while True:
        receiver.receive(_LOOK_EVERY)


def _print(message: Any) -> None:
    print(f"{text(message)}---", flush=True)


def _hz(node: Any, topic: str) -> None:
    moments: deque[float] = deque(maxlen=_WINDOW)
    receiver = _Receiver(node, topic, lambda _: moments.append(time.monotonic()), raw=True)
    last = 0.0
    while True:
        receiver.receive(1.0)
        if not moments or moments[-1] == last:
            print("no new messages", flush=True)
        else:
            last = moments[-1]
            print(_rate(list(moments)), end="", flush=True)


def _rate(moments: Sequence[float]) -> str:
    """The rate of the messages that arrived at ``moments``, s; empty if it was one."""
    steps = [after - before for before, after in zip(moments, moments[1:])]
    if not steps:
        return ""
    mean = (moments[-1] - moments[0]) / len(steps)
    deviation = math.sqrt(sum((one - mean) ** 2 for one in steps) / len(steps))
    return (
        f"average rate: {1 / mean:.3f}\n\tmin: {min(steps):.3f}s max: {max(steps):.3f}s "
        f"std dev: {deviation:.5f}s window: {len(moments)}\n"
    )


class _Absent:
    """Prints once, after a while, that the other side is not there."""

    def __init__(self) -> None:
        self._due = time.monotonic() + QUIET

    def note(self, line: str) -> None:
        if time.monotonic() > self._due:
            print(line, file=sys.stderr, flush=True)
            self._due = math.inf


class _Receiver:
    """Passes the messages of a topic to ``take``, from all publishers, those that come later too.

    ``raw``: as serialised bytes.
    """

    def __init__(self, node: Any, topic: str, take: Callable[[Any], None], *, raw: bool = False) -> None:
        self._node, self._topic, self._take, self._raw = node, topic, take, raw
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._offers: dict[Any, Any] = {}  # a publisher of each quality of service that was offered
        self._quality: Any = None
        self._subscription: Any = None
        self._absent = _Absent()

    def receive(self, seconds: float) -> None:
        """Receives for so long. Raises ValueError if this host lacks the type, or there are several."""
        end = time.monotonic() + seconds
        self._connect()
        while True:
            left = end - time.monotonic()
            if left <= 0:
                break
            self._executor.spin_once(timeout_sec=min(left, _TURN))

    def _connect(self) -> None:
        publishers = self._node.get_publishers_info_by_topic(self._topic)
        kinds = sorted({one.topic_type for one in publishers})
        if len(kinds) > 1:
            raise ValueError(f"{self._topic} has several types: {', '.join(kinds)}")
        for one in publishers:
            self._offers.setdefault((one.qos_profile.reliability, one.qos_profile.durability), one)
        if not self._offers:
            self._absent.note(f"nobody publishes {self._topic} yet")
            return
        quality = quality_of([*self._offers.values()], _DEPTH)
        if publishers and quality != self._quality:
            if self._subscription is not None:
                self._node.destroy_subscription(self._subscription)
            self._quality = quality
            self._subscription = self._node.create_subscription(
                _class_of(kinds[0]), self._topic, self._take, quality, raw=self._raw
            )


def _pub(node: Any, *words: str) -> None:
    *often, _, topic, kind, values = words
    sender = _Sender(node, topic, kind, yaml.safe_load(values or "{}"))
    if often == ["-1"]:
        sender.deliver()
    else:
        sender.repeat(float(often[1]) if often else _USUAL_RATE)


class _Sender:
    """Publishes a message of the type ``kind``. Raises ValueError for ``values`` that it cannot have."""

    def __init__(self, node: Any, topic: str, kind: str, values: Any) -> None:
        self._node, self._topic, self._kind, self._values = node, topic, kind, values
        self._class, self._clock = _class_of(kind), Clock()
        self._message()
        # As `ros2 topic pub`: every subscription connects to it.
        quality = QoSProfile(
            depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
        )
        self._publisher = node.create_publisher(self._class, topic, quality)

    def deliver(self) -> None:
        """Publishes once. Raises ValueError if nobody subscribes, or the message has not arrived."""
        end = time.monotonic() + _MATCHES
        while not self._publisher.get_subscription_count():
            if time.monotonic() > end:
                raise ValueError(f"nothing was published: {self._nobody()}")
            time.sleep(_TURN)
        time.sleep(_BOTH)
        self._publisher.publish(self._message())
        if not self._publisher.wait_for_all_acked(Duration(seconds=_ARRIVES)):
            raise ValueError(f"published, but within {_ARRIVES:g} s it has not arrived at every subscription")
        time.sleep(_BOTH)  # for subscriptions that acknowledge nothing

    def repeat(self, rate: float) -> None:
        """Publishes at ``rate``, Hz, for ever."""
        absent, due = _Absent(), time.monotonic()
        while True:
            self._publisher.publish(self._message())
            if not self._publisher.get_subscription_count():
                absent.note(self._nobody())
            due = max(due + 1 / rate, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))

    def _message(self) -> Any:
        return filled(self._class, self._values, self._clock.now().to_msg())

    def _nobody(self) -> str:
        kinds = {one.topic_type for one in self._node.get_subscriptions_info_by_topic(self._topic)}
        others = f", but as {', '.join(sorted(kinds))}" if kinds else ""
        return f"nobody subscribes to {self._topic} as {self._kind}{others}"


def _class_of(kind: str) -> Any:
    try:
        return message_class(kind)
    except Exception as error:  # whatever is wrong with a package of the host
        raise ValueError(f"this host has no message type {kind}: {error}") from error


_VERBS: Mapping[str, Callable[..., None]] = {"list": _list, "echo": _echo, "hz": _hz, "pub": _pub}
