#!/usr/bin/env python3
"""The driver node of a robot on a serial line: ``serial_driver.py --config FILE [name:=value ...]``.

The thread that owns the line starts first: a robot is stopped even while the graph cannot be reached.
"""

from __future__ import annotations

import sys
from concurrent.futures import Future
from threading import Lock
from typing import TYPE_CHECKING, Callable

from swarm_onboard.command import runner
from swarm_onboard.command.authority import Authority
from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.command_log import command_log
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.report import Level, Reporter
from swarm_onboard.command.stop_latch import StopLatch
from swarm_onboard.common.systemd import Notifier
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.board_relay import BoardRelay
from swarm_onboard.driver.codec import Values
from swarm_onboard.driver.config import Config, Sensor, load
from swarm_onboard.driver.driver import Driver, run
from swarm_onboard.driver.kinematics import Pose
from swarm_onboard.driver.live_parameters import LiveParameters
from swarm_onboard.driver.port import Port
from swarm_onboard.driver.relay import Mailbox
from swarm_onboard.ros import node as ros

if TYPE_CHECKING:
    from swarm_onboard.driver.topics import DriverTopics


class News(Reporter):
    """Forwards a driver's data to ROS once connected, and its events to the journal and systemd."""

    ros: DriverTopics | None

    def odometry(self, pose: Pose) -> None:
        if self.ros:
            self.ros.odometry(pose)

    def reading(self, sensor: Sensor, values: Values) -> None:
        if self.ros:
            self.ros.reading(sensor, values)

    def event(self, level: Level, text: str) -> None:
        print(f"{level.name}: {text}", file=sys.stderr, flush=True)
        self._notifier.status(text, error=level >= Level.ERROR)


class DriverNode:
    """The driver of one robot, as ``runner`` runs it."""

    def __init__(self, config: Config, notifier: Notifier) -> None:
        self.commands = CommandMailbox()
        self._latch = StopLatch(config.stop_file, self.commands)
        self._log = command_log(config.commanders)
        self._authority = Authority(config.commanders, config.command_timeout)
        self._senders = CommandGate(self._authority, self.commands, self._log)
        self._news = News(notifier)
        self._outputs = ActuatorSettings(config.actuators, self.commands.ring)
        self._relay = BoardRelay(Mailbox(self.commands.ring))
        self._driver = Driver(
            config,
            self.commands,
            self._news,
            self._outputs,
            self._relay,
            open_port=lambda: Port(config.port, config.serial),
            standing=self._senders.standing,
        )
        self._live = LiveParameters(config, self._take, self._show, self.commands.ring)
        self._showing = Lock()

    def run(self, beat: Callable[[], None], longest_wait: float) -> None:
        run(self._driver, self.commands, self._latch, beat, longest_wait, live=self._live)

    def join(self, loop: Future[None]) -> ros.Node:
        config = self._live.config
        node = ros.join_for_good("driver", config.namespace, self.commands.stop)
        # Importing messages takes longer than stopping the robot.
        from swarm_onboard.driver.topics import DriverTopics, subscribe_to_settings  # noqa: PLC0415

        with self._showing:
            self._news.ros = DriverTopics(node, self._live.config)
        node.subscribe_to_commands("cmd_vel", config.command_type, self._senders.give)
        for actuator in config.actuators:
            subscribe_to_settings(node, actuator, self._senders, self._outputs)
        for complaint in self._news.ros.left_out:
            print(complaint, file=sys.stderr, flush=True)
        self._relay.join(node)
        return node

    def _take(self, config: Config) -> None:
        self._authority.timeout = config.command_timeout
        self._driver.take(config)
        self._news.event(Level.OK, f"took {config.file} while it runs")

    def _show(self) -> None:
        with self._showing:
            if self._news.ros:
                self._news.ros.take(self._live.config)

    def leave(self) -> None:
        self._log.close()
        self._news.leave()


if __name__ == "__main__":
    sys.exit(runner.main(sys.argv[1:], "Drive a robot on a serial line.", load, DriverNode))
