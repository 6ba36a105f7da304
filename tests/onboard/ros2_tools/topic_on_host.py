"""A host with real ROS 2 on which ``swarmctl topic`` runs its program; prints what was found, as JSON.

``topic_on_host.py IMAGE DISTRO CASES``: the cases are those of ``round_trip.py``. All runs in namespaces of
its own.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from swarmctl.render.middleware import middleware_of
from tests.onboard.domain_relay import two_kinds
from tests.onboard.gate.ros_host import ENVIRONMENT, PLACE, Node, mounted, wait_until

TEXT, NUMBER = "std_msgs/String", "std_msgs/Int32"
GRAPH = "export ROS_DOMAIN_ID=12 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
#: Commands that end with an error.
FAULTS = {
    "several types": ("echo", "/odd"),
    "no type": ("pub", "-1", "--", "/chat", "acme_msgs/msg/Wheel", "{}"),
    "no field": ("pub", "-1", "--", "/cmd", "std_msgs/msg/String", "{text: a}"),
    "no YAML": ("pub", "-1", "--", "/cmd", "std_msgs/msg/String", "{data: a"),
    "nobody": ("pub", "-1", "--", "/nobody", "std_msgs/msg/String", "{data: a}"),
    "another type": ("pub", "-1", "--", "/cmd", "std_msgs/msg/Int32", "{data: 1}"),
}


class Host:
    """The host, with a release of the swarm `lab`."""

    def __init__(self, image: Path, distro: str) -> None:
        self.root = mounted(image, PLACE, two_kinds.NODES, "gate")
        shutil.copy(Path(__file__).with_name("round_trip.py"), self.root / "nodes")
        subprocess.run(("ip", "link", "set", "lo", "up"), check=True)
        release = self.root / "opt/swarm/lab/current"
        release.mkdir(parents=True)
        (release / "setup.bash").write_text(f". /opt/ros/{distro}/setup.bash\n{GRAPH}\n")
        self._tool = middleware_of(distro).topic_tool

    def begin(self, *words: str) -> subprocess.Popen[str]:
        line = self._tool.line("lab", (*self._tool.words, *words))
        return self._shell(f"exec {line}")  # signals reach the program

    def node(self, name: str, publishes: Any = None, subscribes: Any = None) -> Node:
        words = (name, json.dumps(publishes or {}), json.dumps(subscribes or {}))
        script = '. /opt/swarm/lab/current/setup.bash; exec python3 /nodes/ros2_node.py "$@"'
        return Node(("chroot", str(self.root), "bash", "-c", script, "node", *words), ENVIRONMENT)

    def messages(self, cases: str) -> Any:
        line = f". /opt/swarm/lab/current/setup.bash; exec python3 /nodes/round_trip.py '{cases}'"
        done, errors = self._shell(line, "bash").communicate()
        return json.loads(done) if done else errors

    def _shell(self, line: str, shell: str = "sh") -> subprocess.Popen[str]:
        argv = ("chroot", str(self.root), shell, "-c", line)
        pipe = subprocess.PIPE
        return subprocess.Popen(argv, env=ENVIRONMENT, stdout=pipe, stderr=pipe, text=True)


def ended(process: subprocess.Popen[str]) -> Any:
    out, err = process.communicate()
    return process.returncode, out, err


def line_with(process: subprocess.Popen[str], text: str) -> str:
    assert process.stdout is not None
    return next(line for line in process.stdout if text in line)


def repeat(node: Node, value: Any) -> None:
    """Writes the value until the node has ended."""
    while node.process.poll() is None:
        with suppress(BrokenPipeError):
            node.write(value)
        time.sleep(0.1)


def publishers(node: Node, topic: str) -> list[str]:
    """The nodes that publish it, as ``node`` sees them now."""
    before = len(node.lines)
    node.write([topic])
    wait_until(lambda: "nodes" in str(node.lines[before:]), topic)
    return next(list(one["nodes"]) for one in node.lines[before:] if "nodes" in one)


def main(image: str, distro: str, cases: str) -> dict[str, Any]:
    host = Host(Path(image), distro)
    found: dict[str, Any] = {"messages": host.messages(cases)}
    robot = host.node(
        "/k3/driver",
        {"/chat": [TEXT, True], "/odd": [TEXT, False]},
        {"/cmd": [TEXT, "data", False], "/beat": [NUMBER, "data", False]},
    )
    odd = host.node("/odd", {"/odd": [NUMBER, False], "/hidden/_topic": [NUMBER, False]})
    hidden = host.node("/_hidden", {"/chat": [TEXT, False], "/of_hidden": [NUMBER, False]})
    wait_until(lambda: len(publishers(robot, "/odd")) == 2, "two publishers")
    wait_until(lambda: publishers(robot, "/of_hidden"), "the hidden node")
    faults = {what: host.begin(*words) for what, words in FAULTS.items()}
    found["list"] = ended(host.begin("list", "-v"))
    found["faults"] = {what: ended(one) for what, one in faults.items()}
    hidden.end()
    wait_until(lambda: publishers(robot, "/chat") == ["/k3/driver"], "the hidden node has gone")

    robot.write(["/chat", "data", "north"])
    echo = host.begin("echo", "/chat")
    found["latched"] = line_with(echo, "data")
    late = host.node("/late", {"/chat": [TEXT, False], "/cmd": [TEXT, False]})

    threading.Thread(target=repeat, args=(late, ["/chat", "data", "south"]), daemon=True).start()
    found["later"] = line_with(echo, "data")
    echo.terminate()
    found["echo ended"] = [echo.wait(), echo.stderr.read() if echo.stderr else ""]

    once = host.begin("pub", "-1", "--", "/cmd", "std_msgs/msg/String", "{data: it's}")
    found["once"] = ended(once)
    found["received"] = [one["value"] for one in robot.lines if one.get("topic") == "/cmd"]

    beat = host.begin("pub", "-r", "20", "--", "/beat", "std_msgs/msg/Int32", "{data: 5}")
    rate = host.begin("hz", "/beat")
    found["rate"] = [line_with(rate, "average rate"), line_with(rate, "window")]
    beat.terminate()
    found["beat ended"] = ended(beat)
    found["silence"] = line_with(rate, "no new")
    rate.terminate()
    rate.wait()

    pub = host.begin("pub", "--", "/cmd", "std_msgs/msg/String", "{data: a}")
    wait_until(lambda: len(publishers(robot, "/cmd")) == 2, "both publish")
    late.kill()
    pub.terminate()
    looks: list[list[str]] = []

    def has_left() -> bool:  # its name first
        looks.append(publishers(robot, "/cmd"))
        return not any("_swarm_topic" in one or "_UNKNOWN_" in one for one in looks[-1])

    wait_until(has_left, "it leaves")
    found["still in the graph"] = looks[-1]
    odd.end()
    robot.end()
    return found


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:])))
