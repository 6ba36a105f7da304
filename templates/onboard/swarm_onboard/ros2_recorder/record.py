"""What the agent calls to record topics of ROS 2, and the program that its recorder runs in the release."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
from typing import TYPE_CHECKING

from swarm_onboard.agent.observations import GraphSeen
from swarm_onboard.agent.verbs import probe
from swarm_onboard.ros2_probe import observe
from swarm_onboard.ros2_probe.look import joined
from swarm_onboard.ros2_probe.observe import UDP

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.record import Request

_OF_NODES = ("/rosout", "/parameter_events")  # of every node
_FLUSH_EVERY = 1.0  # s, and looks at the graph
_TURN = 0.1  # s of receiving between two looks at the clock


def published(request: Request) -> dict[str, set[str]]:
    """Returns the hosts of the nodes that publish each topic; an empty text for a node whose host is unknown.

    Hidden topics and those of every node are left out unless ``patterns`` has their names. Raises
    ``FailedError`` if no node of this host can join the graph.
    """
    seen = observe.observe(
        probe.Request(
            request.swarm,
            observe.__name__,
            expected={node: {"publishes": [], "subscribes": [], "provides": []} for node in request.awaited},
            homes=request.nodes,
            advertised=request.host,
            graph=True,
        ),
        probe.Answer(),
    )
    graph = GraphSeen(*seen.graph) if seen.graph else GraphSeen({}, {}, [])
    return {
        topic: {home or request.nodes.get(node, "") for node, home in publishers.items()}
        for topic, publishers in graph.publishers.items()
        if topic in request.patterns or not ("/_" in topic or topic in _OF_NODES)
    }


def main() -> None:
    """Records the topics in its arguments until SIGINT; prints in one line what prevents that."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--size", type=int)  # MB
    parser.add_argument("-o", dest="prefix")
    parser.add_argument("topics", nargs="+")
    try:
        _record(parser.parse_args())
    except OSError as error:
        sys.exit(f"bags cannot be written: {error}")
    except Exception as error:  # noqa: BLE001  whatever ROS raises, people get its words
        sys.exit(f"no node of this host can join the graph: {error}")
    sys.stdout.flush()
    os._exit(0)  # some rmw hang while Python ends


def _record(options: argparse.Namespace) -> None:
    stopped = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: stopped.set())
    os.environ.update(UDP)
    from rclpy.executors import SingleThreadedExecutor  # noqa: PLC0415  the agent has no rclpy

    from swarm_onboard.ros2_recorder.bag_files import BagFiles, definition  # noqa: PLC0415
    from swarm_onboard.ros2_recorder.subscriptions import Subscriptions  # noqa: PLC0415

    with joined(f"_swarm_recording_{os.urandom(8).hex()}") as node:
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        began = time.strftime("%Y-%m-%d-%H-%M-%S")
        bags = BagFiles(f"{options.prefix}_{began}", options.size << 20, definition)
        subscriptions = Subscriptions(node, options.topics, bags.add)
        due = 0.0
        while not stopped.is_set():
            if time.monotonic() >= due:
                subscriptions.follow()
                bags.flush()
                due = time.monotonic() + _FLUSH_EVERY
            executor.spin_once(timeout_sec=_TURN)
        bags.close()
    if subscriptions.lacking:
        print(f"not recorded, as this host lacks the type: {', '.join(sorted(subscriptions.lacking))}")
