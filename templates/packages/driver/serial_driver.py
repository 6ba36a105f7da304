#!/usr/bin/env python3
"""The driver node of a robot on a serial line: ``serial_driver.py --config FILE [name:=value ...]``.

The thread that owns the line starts first: a robot is stopped even while the master cannot be reached.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import os
import signal
import sys
from concurrent import futures
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Callable

from swarm_common.systemd import Notifier
from swarm_driver.actuators import ActuatorSettings
from swarm_driver.authority import Authority
from swarm_driver.codec import Values
from swarm_driver.command_gate import CommandGate
from swarm_driver.command_mailbox import CommandMailbox
from swarm_driver.config import Config, ConfigError, Sensor, load
from swarm_driver.driver import Driver, run
from swarm_driver.kinematics import Pose
from swarm_driver.port import Port
from swarm_driver.relay import Mailbox
from swarm_driver.report import Level, Report
from swarm_driver.ros_relay import RosRelay

if TYPE_CHECKING:
    from swarm_driver.ros import RosSink

_LONGEST_WAIT = 1.0  # s
_LOOK_EVERY = 1.0  # s between two looks whether the master knows the node
_MISSES = 2


class TerminatedError(BaseException):
    """A signal ends the driver. Not an Exception, so that no library catches it."""


class UnregisteredError(Exception):
    """The ROS master was restarted and no longer knows this node."""


class Reporter:
    """Forwards a driver's reports: events to the journal and systemd, the rest to ROS once connected."""

    def __init__(self, notifier: Notifier) -> None:
        self.ros: RosSink | None = None
        self._notifier = notifier

    def odometry(self, pose: Pose) -> None:
        if self.ros:
            self.ros.odometry(pose)

    def reading(self, sensor: Sensor, values: Values) -> None:
        if self.ros:
            self.ros.reading(sensor, values)

    def report(self, report: Report) -> None:
        self._notifier.status(report.message)
        if self.ros:
            self.ros.report(report)

    def event(self, level: Level, text: str) -> None:
        print(f"{level.name}: {text}", file=sys.stderr, flush=True)
        self._notifier.status(text)

    def leave(self) -> None:
        if self.ros:
            self.ros.leave()


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    faulthandler.enable()  # systemd's watchdog sends SIGABRT: the journal then says where the driver hung
    parser = argparse.ArgumentParser(description="Drive a robot on a serial line.")
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the robot")
    options = parser.parse_args([argument for argument in arguments if ":=" not in argument])
    try:
        config = load(options.config)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 1
    os.environ.setdefault("ROS_NAMESPACE", config.namespace)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, _terminate)
    try:
        _drive(config)
    except TerminatedError:
        pass
    except UnregisteredError:
        print("the ROS master was restarted: this node ends, so that a new one joins it", file=sys.stderr)
        return os.EX_TEMPFAIL
    return 0


def _drive(config: Config) -> None:
    """Runs until a signal ends the driver. An exception in the loop is raised here, after the stop."""
    commands, notifier = CommandMailbox(), Notifier()
    gate = CommandGate(Authority(config.commanders, config.command_timeout), commands)
    news, outputs = Reporter(notifier), ActuatorSettings(config.actuators, commands.ring)
    relay = RosRelay(Mailbox(commands.ring))
    driver = Driver(
        config,
        commands,
        news,
        outputs,
        relay,
        open_port=lambda: Port(config.port, config.serial),
        standing=gate.standing,
    )
    wait = min(_LONGEST_WAIT, notifier.interval or _LONGEST_WAIT)
    with contextlib.ExitStack() as stack:
        stack.callback(news.leave)
        pool = stack.enter_context(ThreadPoolExecutor(1, "serial-line"))
        stack.callback(commands.stop)  # a signal at any moment from here on ends the loop
        stack.callback(notifier.stopping)
        loop = pool.submit(run, driver, commands, notifier.beat, wait)
        notifier.ready()  # the robot is watched over; a master that is away may take as long as it takes
        from swarm_driver import ros  # noqa: PLC0415  importing ROS takes longer than stopping the robot

        news.ros = ros.join(config, commands, gate, outputs)
        for complaint in news.ros.left_out:
            print(complaint, file=sys.stderr, flush=True)
        relay.join()
        _watch(loop, ros.forgotten)


def _watch(loop: Future[None], forgotten: Callable[[], bool]) -> None:
    """Returns when the loop ends. Raises ``UnregisteredError`` if the master twice does not know the node."""
    misses = 0
    while not futures.wait([loop], _LOOK_EVERY).done:
        misses = misses + 1 if forgotten() else 0
        if misses == _MISSES:
            raise UnregisteredError
    loop.result()


def _terminate(number: int, _frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)
    raise TerminatedError


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
