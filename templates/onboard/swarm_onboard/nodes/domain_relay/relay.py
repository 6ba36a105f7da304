#!/usr/bin/env python3
"""The relay of an island of ROS 2: ``relay.py --config FILE``. It waits for the nodes of other islands."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from pathlib import Path

from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.common.systemd import Notifier
from swarm_onboard.domain_relay.config import load

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
        signal.signal(number, lambda *_: os._exit(0))  # the network forgets its nodes by itself
    from swarm_onboard.domain_relay.domains import Away, Home  # noqa: PLC0415  rclpy takes long to import
    from swarm_onboard.domain_relay.report import Report  # noqa: PLC0415

    notifier, home = Notifier(), Home(config)
    report = Report(config, home.node)
    peers = [Away(config, peer, home) for peer in config.peers]
    notifier.ready()
    while all(time.monotonic() - one.looked < _HANGS for one in peers):
        notifier.status(report.publish(peers))
        notifier.beat()
        time.sleep(min(_TICK, notifier.interval or _TICK))
    print("a domain is not looked at any more", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
