"""The dead-man: no command is in force for longer than a timeout."""

from __future__ import annotations

import math
from typing import Callable

from swarm_onboard.command.command_mailbox import Command, CommandMailbox


class DeadMan:
    """Holds a command in force for ``timeout`` seconds after it arrived, then lets the robot stand.

    Ignores a command from before the dead-man's own beginning: it was meant for another moment.
    """

    def __init__(self, commands: CommandMailbox, timeout: float, clock: Callable[[], float]) -> None:
        self.since = clock()
        self._commands = commands
        self.timeout = timeout
        self._clock = clock

    def in_force(self) -> Command | None:
        """Returns the latest command; None once it has expired."""
        return self._given() if self._clock() < self.due() else None

    def due(self) -> float:
        """Returns the moment at which the latest command expires."""
        command = self._given()
        return command.stamp + self.timeout if command is not None else -math.inf

    def expired(self) -> bool:
        """Returns True if the robot stands for want of commands, and not because it takes none."""
        return not self._commands.closed and self.in_force() is None

    def activity(self, moving: bool) -> str:
        """Returns what the robot is doing, as text for people."""
        if self._commands.held:
            return "stopped by `swarmctl stop`: commands are ignored until `swarmctl start`"
        if self._commands.battery_empty:
            return "standing still"
        if self.in_force() is not None:
            return "driving" if moving else "standing still, as commanded"
        silence = "yet" if self._given() is None else f"for {self.timeout:g} s"
        return f"standing still: no accepted command {silence}"

    def _given(self) -> Command | None:
        command = self._commands.latest if not self._commands.closed else None
        return command if command is not None and command.stamp >= self.since else None
