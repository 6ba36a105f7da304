"""Passes the commands of all senders to the authority; those that it admits go to the mailbox."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Callable, Sequence

from swarm_onboard.command.authority import Authority, Sender, Standing
from swarm_onboard.command.command_log import CommandLog
from swarm_onboard.command.command_mailbox import CommandMailbox

_LONGEST_NAME = 200


class CommandGate:
    """The one way for commands from other nodes, in whichever thread they arrive."""

    def __init__(
        self,
        authority: Authority,
        commands: CommandMailbox,
        log: CommandLog,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._authority = authority
        self._commands = commands
        self._log = log
        self._clock = clock
        self._lock = threading.Lock()

    def give(
        self,
        node: str,
        host: str | None,
        linear: Sequence[float],
        angular: Sequence[float],
        arrived: float,
        *,
        age: float = 0.0,
    ) -> None:
        """Passes a command on or refuses it.

        The decision and the transfer are atomic, so no command overtakes a higher one.
        """
        sender = Sender(node[:_LONGEST_NAME], host)
        with self._lock:
            if self._authority.admits(sender, self._clock(), age):
                self._commands.put(linear, angular, arrived)
                if not self._commands.closed:
                    self._log.admitted(self._authority.commander_name(sender), sender)

    def admits_setting(self, node: str, host: str | None) -> bool:
        """Returns True if a node may set lights and other actuators."""
        with self._lock:
            return self._authority.admits_setting(Sender(node[:_LONGEST_NAME], host), self._clock())

    def standing(self) -> Standing:
        """Returns who is obeyed and who was refused; the complaint has why nothing is recorded, too."""
        with self._lock:
            standing = self._authority.standing(self._clock())
        trouble = self._log.trouble()
        return replace(standing, complaint="; ".join(filter(None, (standing.complaint, trouble))))
