#!/usr/bin/env python3
"""A ROS master behind its guard: ``guarded_master.py --config FILE COMMAND...``, which starts the master.

The guard listens at the host's address, the master on the loopback interface. If one ends, so does the other.
"""

from __future__ import annotations

import argparse
import asyncio
import signal
import sys
from pathlib import Path

from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.guard.config import Config, load
from swarm_onboard.guard.proxy import Proxy

_KILLED_AFTER = 8.0  # s; roscore waits for its nodes


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(
        description="Let through to a ROS master what the spec of the swarm has."
    )
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the guard")
    parser.add_argument("command", nargs=argparse.REMAINDER, help="what starts the master, such as roscore")
    options = parser.parse_args(arguments)
    try:
        config = load(options.config)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 1
    return asyncio.run(_run(config, options.command))


async def _run(config: Config, command: list[str]) -> int:
    """Runs until the command ends or a signal arrives. Returns the exit status of the command."""
    loopback = "[::1]" if ":" in config.address else "127.0.0.1"
    await Proxy(config, f"http://{loopback}:{config.port}").start()
    master = await asyncio.create_subprocess_exec(*command)
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    ended = asyncio.ensure_future(master.wait())
    stopped = asyncio.ensure_future(stop.wait())
    await asyncio.wait([ended, stopped], return_when=asyncio.FIRST_COMPLETED)
    if not ended.done():
        master.terminate()
        if not (await asyncio.wait([ended], timeout=_KILLED_AFTER))[0]:
            master.kill()
    return await ended


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
