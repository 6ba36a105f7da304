"""What the relay between two domains of ROS 2 costs: ``python benchmarks/relay.py [--seconds S]``, as root.

Real rclpy in the lab's images: one publisher whose messages go in turns to a subscriber in its own domain and
through the relay to one in another domain. Exits with 1 if a bar is missed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median, quantiles
from typing import Any

from gate import resident, seconds_of

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from swarmctl.render.quoting import render
from tests.onboard.gate.ros_host import ENVIRONMENT, Node, RosHost, run_isolated, wait_until

DISTROS = ("jazzy", "kilted")
ADDED, CPU = 1.0, 30.0  # bars: ms of the median of commands, % of one core at 20 MB/s of images
ARRIVED = 99.0  # bar: % of the images
HERE, OTHER = 12, 11  # domains
DIRECT, RELAYED = "/direct", "/relayed"
RATES = {"twist": 50.0, "scan": 40.0, "image": 22.0}  # Hz; images of 0.92 MB
MESSAGES = {"twist": "geometry_msgs/Twist", "scan": "sensor_msgs/LaserScan", "image": "sensor_msgs/Image"}
PROFILES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")  # of Fast DDS 2 and 3
INSIDE = "--inside"
SETTLED = 5.0  # s until the nodes have found each other


class Islands(RosHost):
    """Two domains on one host, whose nodes find each other as on the hosts of a swarm."""

    def __init__(self, disk: Path, distro: str, kind: str) -> None:
        crossing = {"topic": RELAYED, "type": MESSAGES[kind], "command": kind == "twist"}
        peer = {"island": "other", "domain": OTHER, "receives": [crossing]}
        parameters = {"island": "here", "node": "/multimaster_here", "domain": HERE, "peers": [peer]}
        self._setup = f". /opt/ros/{distro}/setup.sh; exec "
        super().__init__(disk, parameters, Path(__file__).parent / "onhost", "domain_relay")
        loopback = ["127.0.0.1"]
        profile = render("ros2/fastdds.xml", addresses=loopback, peers=loopback, most=8, servers=[])
        (self.root / "fastdds.xml").write_bytes(profile)

    def start_master(self) -> None:
        """ROS 2 has none."""

    def start(self, command: str, domain: int) -> Node:
        variables = {"ROS_DOMAIN_ID": str(domain), **dict.fromkeys(PROFILES, "/fastdds.xml")}
        return Node(self._inside("sh", "-c", self._setup + command), {**ENVIRONMENT, **variables})


def measured(disk: Path, distro: str, kind: str, seconds: float) -> dict[str, Any]:
    """The figures of one type of message, from inside the namespaces of the host."""
    count, rate = round(seconds * RATES[kind]), RATES[kind]
    host = Islands(disk, distro, kind)
    relay = host.start("python3 /domain_relay/relay.py --config /params.yaml", HERE).process.pid
    script = "python3 /nodes/stamped.py"
    subscribers = {
        DIRECT: host.start(f"{script} subscribe {kind} {DIRECT}", OTHER),
        RELAYED: host.start(f"{script} subscribe {kind} {RELAYED}", HERE),
    }
    time.sleep(SETTLED)
    rest = cpu_percent(relay, seconds)
    publisher = host.start(f"{script} publish {kind} {count} {rate} {DIRECT} {RELAYED}", OTHER)
    wait_until(lambda: subscribers[RELAYED].lines, "the first message")
    busy = cpu_percent(relay, seconds - 1)  # while messages still come
    publisher.process.wait()
    trips = {
        topic: [1000 * (line["arrived"] - line["sent"]) for line in one.lines]
        for topic, one in subscribers.items()
    }
    return {"trips": trips, "count": count, "rest": rest, "cpu": busy, "resident": resident(relay)}


def cpu_percent(pid: int, seconds: float) -> float:
    """The CPU time of a process over the next ``seconds``, % of one core."""
    began, before = time.monotonic(), seconds_of(pid)
    time.sleep(seconds)
    return 100 * (seconds_of(pid) - before) / (time.monotonic() - began)


def shown(distro: str, kind: str, found: dict[str, Any]) -> dict[str, bool]:
    """Print the figures; the bars, and whether they are kept."""
    shares = {topic: 100 * len(trips) / found["count"] for topic, trips in found["trips"].items()}
    for topic, trips in found["trips"].items():
        row = f"{distro:8}{kind:7}{topic[1:]:9}{median(trips):9.2f}{quantiles(trips, n=20)[-1]:9.2f}"
        row += f"{shares[topic]:11.1f}"
        if topic == RELAYED:
            row += f"{found['rest']:9.1f}{found['cpu']:9.1f}{found['resident']:9.1f}"
        print(row, flush=True)
    added = median(found["trips"][RELAYED]) - median(found["trips"][DIRECT])
    share, cpu = shares[RELAYED], found["cpu"]
    bars = {
        "twist": {f"latency that the relay adds, median: {added:.2f} <= {ADDED:g} ms": added <= ADDED},
        "image": {
            f"CPU at 20 MB/s: {cpu:.1f} <= {CPU:g} % of one core": cpu <= CPU,
            f"arrive: {share:.1f} >= {ARRIVED:g} %": share >= ARRIVED,
        },
    }
    return {f"{distro}, {kind}: {bar}": kept for bar, kept in bars.get(kind, {}).items()}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=15.0, help="how long each type of message is sent")
    parser.add_argument("--distro", choices=DISTROS, action="append", help="both, without")
    parser.add_argument(INSIDE, nargs=3, metavar=("IMAGE", "DISTRO", "TYPE"), help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.inside is not None:
        disk, distro, kind = given.inside
        print(json.dumps(measured(Path(disk), distro, kind, given.seconds)))
        return 0
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
    except LabError as error:
        print(error, file=sys.stderr)
        return 1
    print(f"{'':24}{'latency, ms':>18}{'':11}{'the relay:':>18}")
    print(f"{'':24}{'median':>9}{'95 %':>9}{'arrived %':>11}{'rest %':>9}{'CPU %':>9}{'RSS MB':>9}")
    bars: dict[str, bool] = {}
    for distro in given.distro or DISTROS:
        disk = image.ensure(lambda line: print(f"  image: {line}", file=sys.stderr), distro=distro)
        for kind in RATES:
            found = run_isolated(
                Path(__file__).resolve(), "--seconds", given.seconds, INSIDE, disk, distro, kind
            )
            bars |= shown(distro, kind, found)
    for bar, kept in bars.items():
        print(f"{'PASS' if kept else 'FAIL'}: {bar}")
    return int(not all(bars.values()))


if __name__ == "__main__":
    sys.exit(main())
