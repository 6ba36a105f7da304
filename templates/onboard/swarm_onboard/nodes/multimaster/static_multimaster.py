#!/usr/bin/env python3
"""The static multimaster of an island: ``static_multimaster.py --config FILE``.

It waits for unreachable masters (its own included), survives their restarts, and keeps no file.
"""

from __future__ import annotations

import argparse
import asyncio
import signal
import sys
import time
from pathlib import Path
from typing import Any

from swarm_onboard.common import slave
from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.common.systemd import Notifier
from swarm_onboard.common.tcpros import Publication
from swarm_onboard.multimaster import diagnostics
from swarm_onboard.multimaster.bridge import Bridge
from swarm_onboard.multimaster.config import Config, load

_TICK = 1.0  # s between two diagnostics messages


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(
        description="Register declared topics of other ROS masters at this island's master."
    )
    parser.add_argument(
        "--config", type=Path, required=True, help="parameter file of the island's multimaster"
    )
    options = parser.parse_args([argument for argument in arguments if ":=" not in argument])
    try:
        config = load(options.config)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 1
    asyncio.run(_serve(config, Notifier()))
    return 0


async def _serve(config: Config, notifier: Notifier) -> None:
    """Runs until a signal arrives. Raises the exception of a failed task, after unregistering everywhere."""
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    topic = Publication(config.node, diagnostics.TOPIC, diagnostics.TYPE, diagnostics.MD5SUM)
    place = ["TCPROS", config.address, await topic.start()]
    answers = slave.SlaveApi()
    bridge = Bridge(config, f"http://{config.address}:{await answers.start()}/")
    answers.methods = slave.methods(
        config.master,
        {diagnostics.TOPIC: diagnostics.TYPE},
        offer=lambda name: place if name == diagnostics.TOPIC else [],
        wake=bridge.wake,
    )
    notifier.ready()
    ended: asyncio.Future[Any] = asyncio.ensure_future(stop.wait())
    work = [asyncio.ensure_future(bridge.run()), asyncio.ensure_future(_report(bridge, topic, notifier))]
    done, _ = await asyncio.wait([ended, *work], return_when=asyncio.FIRST_COMPLETED)
    notifier.stopping()
    for one in work:
        one.cancel()
    await asyncio.wait(work)
    await bridge.unregister_all()
    for one in work:
        if one in done:
            one.result()


async def _report(bridge: Bridge, topic: Publication, notifier: Notifier) -> None:
    number = 0
    while True:
        status = bridge.status()
        topic.publish(diagnostics.message_of(status, number, time.time()))
        notifier.status(status.message)
        notifier.beat()
        number += 1
        await asyncio.sleep(min(_TICK, notifier.interval or _TICK))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
