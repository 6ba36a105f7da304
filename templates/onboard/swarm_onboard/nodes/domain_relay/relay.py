#!/usr/bin/env python3
"""The relay of an island of ROS 2: ``relay.py --config FILE``. It waits for other islands."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
from pathlib import Path

from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.common.systemd import Notifier
from swarm_onboard.domain_relay.config import Config, load

_TICK = 1.0  # s between two diagnostics messages
_HANGS = 5.0  # s without a look at a domain


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(description="Bring declared topics of other islands to this one.")
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the island's relay")
    options = parser.parse_args(arguments)
    try:
        config = load(options.config)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 1
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda *_: os._exit(0))  # domains forget its nodes by themselves
    return _serve(config)


def _serve(config: Config) -> int:
    from swarm_onboard.domain_relay.domains import Away, Domain, Home  # noqa: PLC0415  rclpy takes long to import
    from swarm_onboard.domain_relay.masters import Masters  # noqa: PLC0415
    from swarm_onboard.domain_relay.report import Report  # noqa: PLC0415
    from swarm_onboard.domain_relay.ros1_island import Ros1Island  # noqa: PLC0415

    notifier, home, ended = Notifier(), Home(config), threading.Event()
    report = Report(config, home.node)
    away = [Away(config, peer, home) for peer in config.peers]
    masters = Masters(config, home)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda *_: ended.set())  # a master of ROS 1 forgets nothing by itself
    peers: list[Away | Ros1Island] = [*away, *masters.islands]
    topics = [*masters.topics, *(topic for one in away for topic in one.topics)]
    delays = [(one.name, one.delays) for one in topics]
    looked: list[Masters | Domain] = [masters, *(one.domain for one in away)]
    if masters.topics:
        looked.append(Domain(home.node, masters.topics, masters.names))
    notifier.ready()
    while not ended.is_set():
        if any(time.monotonic() - one.looked > _HANGS for one in looked):
            print("a domain is not looked at any more", file=sys.stderr)
            return 1
        notifier.status(report.publish([one.state() for one in peers], delays))
        notifier.beat()
        ended.wait(min(_TICK, notifier.interval or _TICK))
    notifier.stopping()
    masters.leave()
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
