#!/usr/bin/env python3
"""Stop a robot whose driver is gone: ``stop_motors.py --config FILE``. Needs no ROS, ends within two seconds.

Exit status 0: the robot confirmed the stop, or its line is absent or belongs to someone else (it says which).
A sketch confirms nothing, and stops its robot by itself.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import time
from pathlib import Path

from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.driver.config import Config, load
from swarm_onboard.driver.kinematics import STANDSTILL
from swarm_onboard.driver.link import FAILED_EXCHANGE, Link, LinkLostError
from swarm_onboard.driver.polled_robot import linked
from swarm_onboard.driver.port import Port, PortError
from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.driver.tally import Tally
from swarm_onboard.rosserial.conversation import Conversation, UnsendableError
from swarm_onboard.rosserial.messages import TWIST_MD5, TWIST_TYPE, twist
from swarm_onboard.rosserial.topics import MessageType

_PATIENCE = 1.8  # s
_LAST_WORD = 0.05  # s for the last bytes to leave before the port is closed


def stop(config: Config) -> tuple[int, str]:
    """Stops the robot and returns the exit status and the message for it."""
    deadline = time.monotonic() + _PATIENCE
    try:
        port = _opened(config, deadline)
    except PortError as error:
        return (0 if error.busy or error.absent else 1), f"nothing to stop here: {error}"
    try:
        if isinstance(config.protocol, RosserialProtocol):
            return _stop_board(port, config, config.protocol, deadline)
        return _described(
            linked(port, config.protocol, Tally()), config, config.protocol.reply_timeout, deadline
        )
    except PortError as error:
        return (0 if error.absent else 1), f"the line went away: {error}"
    except LinkLostError as error:
        return 1, f"nobody knows how to stop {config.robot}: {error}"
    finally:
        port.close()


def _opened(config: Config, deadline: float) -> Port:
    """The port. A driver that was just killed may hold it for another moment."""
    while True:
        try:
            return Port(config.port, config.serial)
        except PortError as error:  # noqa: PERF203
            if not error.busy or time.monotonic() + 0.1 > deadline:
                raise
            time.sleep(0.1)


def _described(link: Link, config: Config, reply_timeout: float, deadline: float) -> tuple[int, str]:
    """Sends the stop until the robot confirms it, also before the line has settled."""
    while True:
        try:
            link.set_speed(*STANDSTILL)
            return 0, f"{config.robot} confirmed the stop"
        except FAILED_EXCHANGE as error:  # noqa: PERF203
            if time.monotonic() + reply_timeout > deadline:
                return 1, f"{config.robot} did not confirm the stop: {error}; {config.serial.hint}"


def _stop_board(port: Port, config: Config, protocol: RosserialProtocol, deadline: float) -> tuple[int, str]:
    """Sends one stop, which no board confirms. A board that resets on opening receives nothing at first."""
    types = {TWIST_TYPE: MessageType(TWIST_MD5, len(twist(0.0, 0.0)))}
    board = Conversation(port.write, types.get, settle=0.0, clock=time.monotonic, wall=time.time_ns)
    while time.monotonic() < deadline:
        board.step(port.read(min(board.due(), deadline) - time.monotonic()))
        with contextlib.suppress(UnsendableError):
            board.send("cmd_vel", twist(0.0, 0.0))
            board.stop()
            port.read(_LAST_WORD)
            return 0, f"{config.robot} was sent a stop"
    dead_man = f"its sketch stops it {protocol.firmware_timeout:g} s after its last command"
    return 0, f"{config.robot} does not answer: {dead_man}"


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(description="Stop a robot whose driver is gone.")
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the robot")
    try:
        status, message = stop(load(parser.parse_args(arguments).config))
    except ConfigError as error:
        status, message = 1, str(error)
    print(message, file=sys.stderr if status else sys.stdout, flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
