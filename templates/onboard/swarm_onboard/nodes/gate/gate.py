#!/usr/bin/env python3
"""The gate in front of a robot's driver: ``gate.py --config FILE [name:=value ...]``.

However it ends, but by SIGKILL, its last message is a zero; after that, `send_zero.py` sends one.
"""

from __future__ import annotations

import sys
from concurrent import futures
from concurrent.futures import Future
from typing import TYPE_CHECKING, Callable

from swarm_onboard.command import runner
from swarm_onboard.command.authority import Authority
from swarm_onboard.command.battery_watch import BatteryWatch
from swarm_onboard.command.command_gate import CommandGate
from swarm_onboard.command.command_log import command_log
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.limits import Velocity
from swarm_onboard.command.report import Reporter
from swarm_onboard.command.stop_latch import StopLatch
from swarm_onboard.common.systemd import Notifier
from swarm_onboard.gate.config import COMMAND, NODE, Config, load
from swarm_onboard.gate.gate import Gate, run
from swarm_onboard.gate.robot_state import OdometryWatch, PowerWatch
from swarm_onboard.gate.wiring import WiringWatch
from swarm_onboard.ros import node as ros

if TYPE_CHECKING:
    from swarm_onboard.gate.topics import GateTopics

_LAST_ZERO = 2.0  # s that a shutdown by ROS waits for it


class Output(Reporter):
    """Forwards velocities to ROS once connected."""

    ros: GateTopics | None

    def send(self, velocity: Velocity) -> None:
        if self.ros:
            self.ros.send(velocity)

    def receivers(self) -> int:
        return self.ros.receivers() if self.ros else 0

    def flush(self) -> None:
        if self.ros:
            self.ros.flush()


class GateNode:
    """The gate of one robot, as ``runner`` runs it."""

    def __init__(self, config: Config, notifier: Notifier) -> None:
        self.commands = CommandMailbox()
        self._latch = StopLatch(config.stop_file, self.commands)
        self._config = config
        self._log = command_log(config.commanders)
        authority = Authority(config.commanders, config.command_timeout)
        self._senders = CommandGate(authority, self.commands, self._log)
        self._wiring = WiringWatch(config)
        self._output = Output(notifier)
        self._odometry = OdometryWatch(config.odometry) if config.odometry else None
        known = config.battery or config.docked
        charge = BatteryWatch(config.battery_limits, self.commands)
        self._power = PowerWatch(config.battery, config.docked, charge) if known else None
        self._gate = Gate(
            config, self.commands, self._output, standing=self._senders.standing, wiring=self._wiring.latest,
            odometry=self._odometry, power=self._power,
        )  # fmt: skip

    def run(self, beat: Callable[[], None], longest_wait: float) -> None:
        run(self._gate, self.commands, self._latch, beat, longest_wait)

    def join(self, loop: Future[None]) -> ros.Node:
        def end() -> None:
            """Runs when ROS fails in this process, before it closes the connections."""
            self.commands.stop()
            futures.wait([loop], _LAST_ZERO)

        node = ros.join_for_good(NODE, self._config.namespace, end)
        # Importing messages takes longer than systemd should wait.
        from swarm_onboard.gate import topics  # noqa: PLC0415

        self._output.ros = topics.GateTopics(node, self._config, self._gate.greet)
        for complaint in self._output.ros.left_out:
            print(complaint, file=sys.stderr, flush=True)
        node.subscribe_to_commands(COMMAND, self._config.command_type, self._senders.give)
        self._wiring.start(node.publishers_and_subscribers, node.has_ended)
        if self._odometry is not None:
            topics.read_odometry(node, self._odometry)
        if self._power is not None:
            topics.read_power(node, self._power)
        return node

    def leave(self) -> None:
        self._log.close()
        self._output.leave()


if __name__ == "__main__":
    ros.leave_out_numpy()
    sys.exit(runner.main(sys.argv[1:], "Decide which commands reach a robot's driver.", load, GateNode))
