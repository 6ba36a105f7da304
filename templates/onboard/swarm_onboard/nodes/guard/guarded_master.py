#!/usr/bin/env python3
"""A ROS master behind its guard, and rosout: ``guarded_master.py --config FILE``.

The master is an object in this process, without a port that another account could take. Where the guard
listens, systemd keeps the sockets while the unit restarts.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import signal
import socket
import sys
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any, Callable, Iterator
from xmlrpc.server import SimpleXMLRPCDispatcher

import rospkg
from roslib.packages import find_node
from rosmaster.master_api import ROSMasterHandler

from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.common.systemd import Notifier
from swarm_onboard.guard.config import Config, load
from swarm_onboard.guard.proxy import Proxy

_FIRST = 3  # the first file that systemd passes (sd_listen_fds(3))
_BACKLOG = 128
_LOOK_EVERY = 1.0  # s: a deploy brings other parameters, and restarts no master for them
_ROSOUT_AFTER = 1.0  # s until rosout starts again
_CALLER = "/roslaunch"


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(
        description="Let through to a ROS master what the spec of the swarm has."
    )
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the guard")
    options = parser.parse_args(arguments)
    try:
        config = load(options.config)
        rosout = find_node("rosout", "rosout")[0]
        asyncio.run(_run(config, options.config, rosout))
    except (ConfigError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    except (IndexError, rospkg.ResourceNotFound):
        print("the ROS package rosout is not here", file=sys.stderr)
        return 1
    return 0


async def _run(config: Config, path: Path, rosout: str) -> None:
    """Runs until a signal arrives."""
    proxy = Proxy(config, _master(config))
    await proxy.start(list(_listeners(config)))
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    tasks = [asyncio.ensure_future(one) for one in (_follow(path, proxy), _respawn(rosout))]
    await stop.wait()
    for one in tasks:
        one.cancel()
        with suppress(asyncio.CancelledError):
            await one


def _master(config: Config) -> Callable[[bytes], bytes]:
    """What replies to XML-RPC requests: a master with the parameters that roscore sets (roscore.xml)."""
    handler = ROSMasterHandler()
    handler._ready(config.uri)
    version = rospkg.RosPack().get_manifest("roslaunch").version
    handler.setParam(_CALLER, "/rosdistro", os.environ["ROS_DISTRO"] + "\n")
    handler.setParam(_CALLER, "/rosversion", f"{version}\n")
    handler.setParam(_CALLER, "/run_id", str(uuid.uuid1()))
    master: Any = SimpleXMLRPCDispatcher()  # its document as bytes: typeshed calls it a text
    master.register_multicall_functions()
    master.register_instance(handler)
    return master._marshaled_dispatch  # type: ignore[no-any-return]


def _listeners(config: Config) -> Iterator[socket.socket]:
    """A socket for each place: what systemd has kept, or a new one. Those of other places are closed."""
    kept = {one.getsockname()[:2]: one for one in _passed()}
    for place in config.places:
        known = kept.pop((place, config.port), None)
        if known is None:
            family = socket.AF_INET6 if ":" in place else socket.AF_INET
            known = socket.create_server((place, config.port), family=family, backlog=_BACKLOG)
        yield known
    for (place, port), one in kept.items():
        Notifier().forget(f"{place}-{port}")
        one.close()


def _passed() -> Iterator[socket.socket]:
    """The sockets that systemd passes to this process."""
    count = int(os.environ.pop("LISTEN_FDS", 0)) if os.environ.get("LISTEN_PID") == str(os.getpid()) else 0
    for number in range(_FIRST, _FIRST + count):
        os.set_inheritable(number, False)
        yield socket.socket(fileno=number)


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


async def _respawn(rosout: str) -> None:
    """Runs rosout, again and again, until this is cancelled."""
    while True:
        process = await asyncio.create_subprocess_exec(rosout, "__name:=rosout")
        try:
            await process.wait()
        except asyncio.CancelledError:
            process.terminate()
            await process.wait()
            raise
        await asyncio.sleep(_ROSOUT_AFTER)


def _version(path: Path) -> tuple[int, int] | None:
    """What differs between two files at ``path``, a link in it included; None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
