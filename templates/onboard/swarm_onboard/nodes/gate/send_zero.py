#!/usr/bin/env python3
"""Send a zero to the driver behind a gate that is gone: ``send_zero.py --config FILE``. Takes at most 2 s.

It speaks ROS's protocols by itself, as importing rospy takes longer than all of this.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import sys
import xmlrpc.client
from pathlib import Path
from typing import Any, Mapping

from swarm_onboard.common import slave
from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.common.tcpros import Publication
from swarm_onboard.common.xmlrpc import Names, PeerError, bounded, loads, post
from swarm_onboard.gate.config import Config, load
from swarm_onboard.gate.motion import MD5, zero

_PATIENCE = 1.8  # s
_LOOK_EVERY = 0.005  # s
_LAST_WORD = 0.05  # s for the last bytes to leave before the connections are closed
_LARGEST_REPLY = 1 << 20


async def send(config: Config, environment: Mapping[str, str]) -> tuple[int, str]:
    """Sends the zero and returns the exit status and the message for it."""
    try:
        return await bounded(_PATIENCE, _send(config, environment))
    except PeerError as error:
        return 1, f"no zero reached the driver of {config.robot}: {error}"


async def _send(config: Config, environment: Mapping[str, str]) -> tuple[int, str]:
    host = environment.get("ROS_IP") or environment.get("ROS_HOSTNAME") or "127.0.0.1"
    master, kind = environment.get("ROS_MASTER_URI", "http://127.0.0.1:11311"), config.output_type
    zeros = Publication(config.node, config.output, kind, MD5[kind], first=zero(kind))
    port = await zeros.start()
    answers = slave.SlaveApi()
    own = f"http://{host}:{await answers.start()}/"
    answers.methods = slave.methods(
        master, {config.output: kind}, lambda _topic: ["TCPROS", host, port], lambda _topic: None
    )
    # Under the gate's own name: the master then forgets the dead gate, and lists no second publisher.
    subscribers = await _call(master, "registerPublisher", config.node, config.output, kind, own)
    while zeros.served < len(subscribers):
        await asyncio.sleep(_LOOK_EVERY)
    await asyncio.sleep(_LAST_WORD)
    with contextlib.suppress(PeerError):
        await _call(master, "unregisterPublisher", config.node, config.output, own)
    if not subscribers:
        return 0, f"nobody subscribes to {config.output}: no zero was sent"
    return 0, f"the driver of {config.robot} was sent a zero"


async def _call(master: str, method: str, *arguments: Any) -> Any:
    """Returns the value of a master's answer. Raises ``PeerError``."""
    body = xmlrpc.client.dumps(arguments, method).encode("utf-8")
    values, _ = loads(await bounded(_PATIENCE, post(master, body, Names(), _LARGEST_REPLY)))
    code, message, value = values[0]
    if code != 1:
        raise PeerError(str(message))
    return value


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(description="Send a zero to the driver behind a gate that is gone.")
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the gate")
    options = parser.parse_args(arguments)
    if os.environ.get("SERVICE_RESULT") == "success":
        return 0  # the gate's own last message was a zero
    try:
        status, message = asyncio.run(send(load(options.config), os.environ))
    except ConfigError as error:
        status, message = 1, str(error)
    print(message, file=sys.stderr if status else sys.stdout, flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
