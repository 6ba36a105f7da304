#!/usr/bin/env python3
"""A ROS master behind its guard: ``guarded_master.py --config FILE COMMAND...``, which starts the master.

The guard listens at the host's address, the master on the loopback interface. If one ends, so does the other.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import signal
import sys
from pathlib import Path

from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.guard.config import Config, load
from swarm_onboard.guard.proxy import Proxy

_LOOPBACK = Path(__file__).resolve().parent / "loopback"  # has the `rosmaster` that roscore is to find
_LOOK_EVERY = 1.0  # s: a deploy brings other parameters, and restarts no master for them
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
    return asyncio.run(_run(config, options.config, options.command))


async def _run(config: Config, path: Path, command: list[str]) -> int:
    """Runs until the command ends or a signal arrives. Returns the exit status of the command."""
    loopback = "[::1]" if ":" in config.address else "127.0.0.1"
    proxy = Proxy(config, f"http://{loopback}:{config.port}")
    await proxy.start()
    following = asyncio.ensure_future(_follow(path, proxy))
    environment = {**os.environ, "PATH": f"{_LOOPBACK}:{os.environ['PATH']}"}
    master = await asyncio.create_subprocess_exec(*command, env=environment)
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
    following.cancel()
    return await ended


async def _follow(path: Path, proxy: Proxy) -> None:
    """Gives the proxy what ``path`` has, whenever it changes; what cannot be read changes nothing."""
    seen = _version(path)
    while True:
        await asyncio.sleep(_LOOK_EVERY)
        if seen != (seen := _version(path)):
            try:
                proxy.use(load(path))
            except ConfigError as error:
                print(error, file=sys.stderr, flush=True)


def _version(path: Path) -> tuple[int, int] | None:
    """What differs between two files at ``path``, a link in it included; None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
