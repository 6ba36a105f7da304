"""An island of ROS 1 and one of ROS 2 with the relay between them; prints what was found, as JSON.

``two_kinds.py IMAGE IMAGE DISTRO``: the images of both, and the distro of the second. All runs in namespaces
of its own. What never happens ends the script.
"""

from __future__ import annotations

import json
import signal
import socket
import sys
import threading
import time
import xmlrpc.client
from collections import Counter
from pathlib import Path
from typing import Any

from tests.onboard.gate.ros_host import ENVIRONMENT, PLACE, URI, Node, RosHost, mounted, wait_until

NODES = Path(__file__).with_name("nodes")
TEXT, TWIST, ODOMETRY = "std_msgs/String", "geometry_msgs/Twist", "nav_msgs/Odometry"
ADDRESS = "127.0.0.3"  # of the relay; nodes of ROS 1 are at 127.0.0.1
STAMP = "header.stamp.sec"
HANGS, GARBAGE = 11312, 11313  # ports of what is no master


def crossing(*topics: tuple[str, str]) -> list[dict[str, Any]]:
    return [{"topic": topic, "type": kind, "command": kind == TWIST} for topic, kind in topics]


PARAMETERS = {
    "island": "tb", "node": "/multimaster_tb", "domain": 12, "address": ADDRESS,
    "peers": [{
        "island": "koala", "master": URI, "hosts": ["127.0.0.1"],
        "receives": crossing(("/chat", TEXT), ("/map", TEXT), ("/drive", TWIST), ("/odom", ODOMETRY),
                             ("/odd", "std_msgs/Int32")),
        "sends": crossing(("/chat", TEXT), ("/plan", TEXT), ("/cmd_vel", TWIST)),
    }, *(
        {"island": name, "master": f"http://127.0.0.1:{port}", "hosts": [name],
         "receives": crossing(("/chat", TEXT)), "sends": crossing(("/chat", TEXT))}
        for name, port in (("hangs", HANGS), ("garbage", GARBAGE))
    )],
}  # fmt: skip


def be_no_masters() -> socket.socket:
    """Starts what accepts connections and does not answer, which it returns, and what answers garbage."""
    hangs, garbage = (socket.create_server(("127.0.0.1", port)) for port in (HANGS, GARBAGE))

    def answer() -> None:
        while True:
            connection, _ = garbage.accept()
            connection.sendall(b"HTTP/1.0 200 OK\r\nContent-Length: 7\r\n\r\n<boo/>\n")
            connection.close()

    threading.Thread(target=answer, daemon=True).start()
    return hangs


class Islands:
    """Both islands, and the relay."""

    def __init__(self, image: Path, image_2: Path, distro: str) -> None:
        self.ros1 = RosHost(image, {}, NODES, "multimaster")
        (PLACE / "other").mkdir()
        self._root = mounted(image_2, PLACE / "other", NODES, "domain_relay")
        (self._root / "params.yaml").write_text(json.dumps(PARAMETERS))
        prefix = f"/opt/ros/{distro}"
        self._environment = {
            **ENVIRONMENT,
            "AMENT_PREFIX_PATH": prefix,
            "LD_LIBRARY_PATH": f"{prefix}/lib",
            "PYTHONPATH": f"{prefix}/lib/python3.11/site-packages",
            "ROS_DISTRO": distro,
            "ROS_DOMAIN_ID": "12",
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }

    def relay(self) -> Node:
        return self._inside("/domain_relay/relay.py", "--config", "/params.yaml")

    def node_1(self, name: str, publishes: Any = None, subscribes: Any = None) -> Node:
        return self.ros1.node("ros1_node.py", name, json.dumps(publishes or {}), json.dumps(subscribes or {}))

    def node_2(self, name: str, publishes: Any = None, subscribes: Any = None) -> Node:
        return self._inside(
            "/nodes/ros2_node.py", name, json.dumps(publishes or {}), json.dumps(subscribes or {})
        )

    def _inside(self, *argv: str) -> Node:
        return Node(("chroot", str(self._root), "python3", *argv), self._environment)


def master() -> Any:
    return xmlrpc.client.ServerProxy(URI)


def publishers_at_master() -> dict[str, list[str]]:
    return {topic: sorted(nodes) for topic, nodes in master().getSystemState("/test")[2][0]}


def relays_at_master() -> list[str]:
    """All nodes that publish or subscribe, and have a URI at the relay's address."""
    state = master().getSystemState("/test")[2][:2]
    names = {name for entries in state for _, nodes in entries for name in nodes}
    return sorted(name for name in names if f"//{ADDRESS}:" in master().lookupNode("/test", name)[2])


def got(node: Node, topic: str) -> list[Any]:
    return [one["value"] for one in list(node.lines) if one.get("topic") == topic]


def reaches(source: Node, target: Node, topic: str, path: str, value: Any) -> None:
    """Publishes until it arrives."""

    def arrived() -> bool:
        source.write([topic, path, value])
        time.sleep(0.1)
        return value in got(target, topic)

    wait_until(arrived, f"{value} on {topic}: {target.lines[-3:]}")


def latest_report(node: Node) -> Any:
    reports = got(node, "/diagnostics")
    return reports[-1][0] if reports else [0, "", {}]


def main(image: str, image_2: str, distro: str) -> dict[str, Any]:
    islands, found = Islands(Path(image), Path(image_2), distro), {}
    hangs = be_no_masters()
    driver = islands.node_1(
        "/koala/driver",
        {"/chat": [TEXT, False], "/map": [TEXT, True], "/odom": [ODOMETRY, False], "/diary": [TEXT, True]},
        {"/chat": [TEXT, "data"], "/cmd_vel": [TWIST, "linear.x"], "/diary": [TEXT, "data"]},
    )  # fmt: skip
    driver.write(["/map", "data", "attic"])
    stick = islands.node_1("/stick", {"/drive": [TWIST, True]}, {})
    stick.write(["/drive", "linear.x", 1.0])
    wait_until(lambda: "/drive" in publishers_at_master(), "the driver")
    brain = islands.node_2(
        "/tb/brain",
        {"/chat": [TEXT, False], "/plan": [TEXT, True], "/cmd_vel": [TWIST, False], "/diary": [TEXT, True]},
        {"/chat": [TEXT, "data", False], "/map": [TEXT, "data", True], "/odom": [ODOMETRY, STAMP, False],
         "/drive": [TWIST, "linear.x", True], "/diary": [TEXT, "data", True],
         "/diagnostics": ["diagnostic_msgs/DiagnosticArray", "status", False]},
    )  # fmt: skip
    brain.write(["/plan", "data", "north"])
    relay = islands.relay()

    wait_until(lambda: got(brain, "/map"), "the latched map")
    late_1 = islands.node_1("/late", {}, {"/plan": [TEXT, "data"]})
    late_2 = islands.node_2("/late", {}, {"/map": [TEXT, "data", True]})
    wait_until(lambda: got(late_1, "/plan") and got(late_2, "/map"), "latched messages for late ones")
    found["latched"] = [got(late_1, "/plan"), got(late_2, "/map"), late_1.lines[0]["from"]]

    reaches(driver, brain, "/chat", "data", "first 1")
    reaches(brain, driver, "/chat", "data", "first 2")
    for number in range(20):
        driver.write(["/chat", "data", f"1 {number}"])
        brain.write(["/chat", "data", f"2 {number}"])
        time.sleep(0.05)  # a loop would need some time
    wait_until(lambda: "1 19" in got(brain, "/chat") and "2 19" in got(driver, "/chat"), "the last ones")
    time.sleep(0.5)
    for name, node in (("driver", driver), ("brain", brain)):
        counted = Counter(text for text in got(node, "/chat") if not text.startswith("first"))
        found[f"times at {name}"] = sorted(set(counted.values())), len(counted)

    reaches(brain, driver, "/cmd_vel", "linear.x", 0.25)
    found["authority"] = next(one["from"] for one in driver.lines if one["topic"] == "/cmd_vel")
    reaches(stick, brain, "/drive", "linear.x", 2.0)
    found["drive"] = sorted(set(got(brain, "/drive")))
    driver.write(["/odom", "header.stamp.secs", 1234])
    wait_until(lambda: got(brain, "/odom"), "odometry")
    found["stamp"] = got(brain, "/odom")[0]

    brain.write(["/odom"])
    found["names"] = wait_until(lambda: [one for one in brain.lines if "publishers" in one], "the graph")[0][
        "nodes"
    ]
    driver.write(["/diary", "data", "secret 1"])
    brain.write(["/diary", "data", "secret 2"])
    reaches(driver, brain, "/chat", "data", "after 1")
    reaches(brain, driver, "/chat", "data", "after 2")
    found["undeclared"] = [got(driver, "/diary"), got(brain, "/diary"), publishers_at_master()["/diary"]]

    odd = islands.node_1("/odd", {"/odd": [TEXT, False]})
    wait_until(lambda: "std_msgs/String" in latest_report(brain)[1], f"the type: {latest_report(brain)}")
    found["type differs"] = latest_report(brain)
    odd.end()

    clash_1 = islands.node_1("/clash", {}, {"/cmd_vel": [TWIST, "linear.x"]})
    wait_until(lambda: master().lookupNode("/test", "/clash")[0] == 1, "the node of ROS 1")
    before = master().lookupNode("/test", "/clash")[2]
    clash_2 = islands.node_2("/clash", {"/cmd_vel": [TWIST, False]})
    wait_until(lambda: "/clash" in latest_report(brain)[1], f"the clash: {latest_report(brain)}")
    found["clash"] = [master().lookupNode("/test", "/clash")[2] == before, clash_1.process.poll()]
    found["clash report"] = latest_report(brain)
    clash_2.end()
    wait_until(lambda: "/clash" not in latest_report(brain)[1], "the clash is over")

    stranger = ("/stranger", "/chat", TEXT, "http://10.9.9.9:1/")
    master().registerPublisher(*stranger)
    wait_until(lambda: "/stranger" in latest_report(brain)[1], f"a stranger: {latest_report(brain)}")
    found["stranger"] = latest_report(brain)
    master().unregisterPublisher("/stranger", "/chat", "http://10.9.9.9:1/")
    brain.write(["/plan", "", "garbage"])
    wait_until(lambda: "/plan of /tb/brain" in latest_report(brain)[1], "garbage of ROS 2")
    reaches(brain, driver, "/chat", "data", "after garbage")
    hidden = islands.node_2("/_hidden", {"/chat": [TEXT, False]})  # as those of `ros2 topic pub`
    reaches(hidden, driver, "/chat", "data", "of a hidden node")
    hidden.end()
    wait_until(lambda: "/_hidden" not in relays_at_master(), "a node that has gone is unregistered")

    relay.process.send_signal(signal.SIGKILL)
    relay.process.wait()
    found["left by SIGKILL"] = relays_at_master()
    brain.end()
    old_uri = master().lookupNode("/test", "/multimaster_tb")[2]
    relay = islands.relay()
    wait_until(lambda: relays_at_master() == ["/multimaster_tb"], "the names of gone nodes are released")
    wait_until(lambda: master().lookupNode("/test", "/multimaster_tb")[2] != old_uri, "its own new URI")
    brain = islands.node_2("/tb/brain", {"/chat": [TEXT, False]}, {"/chat": [TEXT, "data", False]})
    reaches(brain, driver, "/chat", "data", "after SIGKILL")

    islands.ros1.master.kill()
    islands.ros1.master.wait()
    time.sleep(2.5)  # some vain looks
    islands.ros1.start_master()
    fresh = islands.node_1("/koala/fresh", {"/chat": [TEXT, False]}, {"/chat": [TEXT, "data"]})
    reaches(fresh, brain, "/chat", "data", "after the restart 1")
    reaches(brain, fresh, "/chat", "data", "after the restart 2")
    found["after the restart"] = relays_at_master()
    relay.process.send_signal(signal.SIGTERM)
    found["status"] = relay.process.wait()
    found["left by SIGTERM"] = relays_at_master()
    hangs.close()
    return found


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:])))
