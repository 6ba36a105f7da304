"""A node of ROS 2 that a test runs on a lab host: it publishes, and prints messages and the graph."""

from __future__ import annotations

import json
import subprocess
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from tests.child_process import child_process
from tests.e2e.lab_swarm import SOURCE, LabSwarm, quoted, until
from tests.timing import PATIENCE

#: It publishes each line of its input, `/TOPIC TEXT`, and prints what it receives and how the graph changes.
_NODE = """
import json, sys, threading, rclpy
from rclpy.qos import QoSProfile, DurabilityPolicy, ReliabilityPolicy, qos_profile_sensor_data
from std_msgs.msg import String
name, publishes, subscribes = sys.argv[1], *map(json.loads, sys.argv[2:])
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
qualities = {"plain": QoSProfile(depth=50), "latched": latched, "sensor": qos_profile_sensor_data}
rclpy.init()
node = rclpy.create_node(name)
publishers = {topic: node.create_publisher(String, topic, qualities[one]) for topic, one in publishes.items()}
def printing(topic):
    return lambda message: print(json.dumps({"received": (topic, message.data)}))
for topic, one in subscribes.items():
    node.create_subscription(String, topic, printing(topic), qualities[one])
seen = {}
def look():
    topics = [topic for topic, _ in node.get_topic_names_and_types()]
    found = {topic: [(one.node_name, one.qos_profile.reliability == ReliabilityPolicy.RELIABLE)
        for one in node.get_publishers_info_by_topic(topic)] for topic in topics}
    now = {"nodes": node.get_node_names(), "publishers": found}
    if now != seen:
        seen.update(now)
        print(json.dumps(now))
node.create_timer(0.1, look)
def publish():
    for line in sys.stdin:
        topic, _, text = line.strip().partition(" ")
        publishers[topic].publish(String(data=text))
    rclpy.shutdown()
threading.Thread(target=publish, daemon=True).start()
try:
    rclpy.spin(node)
except rclpy.executors.ExternalShutdownException:
    pass
"""


class LabNode:
    """A running node of a test. All its topics are of std_msgs/String."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.received: list[tuple[str, str]] = []  # topic and text
        self.nodes: list[str] = []  # of the graph
        self.publishers: dict[str, list[tuple[str, bool]]] = {}  # by topic: node, and whether it is reliable
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            found = json.loads(line)
            if "received" in found:
                topic, text = found["received"]
                self.received.append((topic, text))
            else:
                ends = found["publishers"].items()
                self.publishers = {topic: [(name, good) for name, good in some] for topic, some in ends}
                self.nodes = found["nodes"]

    def publish(self, topic: str, text: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{topic} {text}\n")
        self._process.stdin.flush()

    def receives(self, topic: str, text: str, times: int = 1) -> None:
        """Wait until a message has come that often, and no more often."""
        until(
            lambda: self.received.count((topic, text)) >= times,
            lambda: f"{text!r} is not received {times} times on {topic}: {self.received}",
        )
        assert self.received.count((topic, text)) == times, f"{text!r} is received again on {topic}"

    def reaches(self, subscriber: LabNode, topic: str) -> None:
        """Publish until something arrives: the two are connected then."""
        sent: list[tuple[str, str]] = []

        def arrives() -> bool:
            sent.append((topic, f"hello {id(self)} {len(sent)}"))
            self.publish(*sent[-1])
            return not set(sent).isdisjoint(subscriber.received)

        until(arrives, lambda: f"nothing arrives on {topic}, published by {subscriber.publishers.get(topic)}")

    def end(self) -> None:
        """End it as Ctrl-C does: it takes leave of the graph."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        assert self._process.wait(PATIENCE) == 0


@contextmanager
def lab_node(
    lab: LabSwarm, host: str, name: str, publishes: Mapping[str, str], subscribes: Mapping[str, str]
) -> Iterator[LabNode]:
    """A node on a host. ``publishes`` and ``subscribes``: ``plain``, ``latched`` or ``sensor`` by topic."""
    words = (_NODE, name, json.dumps(publishes), json.dumps(subscribes))
    argv = lab.shell_argv(host, f"{SOURCE}; exec python3 -uc {' '.join(map(quoted, words))}")
    with child_process(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        node = LabNode(process)
        until(lambda: name in node.nodes, f"{name} does not start")
        yield node
        node.end()
