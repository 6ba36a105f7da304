"""The gate without ROS: passes on at once what the mailbox has, within limits, and zeros when that is old."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, Callable, Mapping, Protocol

from swarm_onboard.command.authority import Standing
from swarm_onboard.command.command_mailbox import Command, CommandMailbox
from swarm_onboard.command.dead_man import DeadMan
from swarm_onboard.command.limits import STANDSTILL, Velocity
from swarm_onboard.command.report import Level, Report
from swarm_onboard.command.stop_latch import StopLatch
from swarm_onboard.gate.config import Config
from swarm_onboard.gate.motion import limited, on_axes
from swarm_onboard.gate.robot_state import OdometryWatch, PowerWatch
from swarm_onboard.gate.wiring import Wiring

MOST_COMMANDS = 110.0  # Hz, on average; of what comes faster the latest is sent, and a stop at once
JITTER = 0.02  # s that commands may be ahead of that rate: a commander at 100 Hz is never held back


class Sink(Protocol):
    """Receives what a gate lets through; ``ros.RosSink`` publishes it."""

    def send(self, velocity: Velocity) -> None:
        """Takes the velocity that the robot is to have now."""

    def receivers(self) -> int:
        """Returns how many nodes what is sent goes to."""
        ...

    def flush(self) -> None:
        """Returns when what was sent is on its way."""

    def report(self, report: Report) -> None:
        """Takes the state of the gate, as /diagnostics shows it."""


@dataclass
class _Tally:
    """Counts what has happened since the gate started."""

    slowed: int = 0
    without_axis: int = 0
    dead_man_trips: int = 0


class Gate:
    """``step`` and ``close`` belong to one thread; commands come through ``commands`` from any other."""

    def __init__(
        self,
        config: Config,
        commands: CommandMailbox,
        sink: Sink,
        *,
        standing: Callable[[], Standing] = Standing,
        wiring: Callable[[], Wiring | None] = lambda: None,
        odometry: OdometryWatch | None = None,
        power: PowerWatch | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """``wiring`` returns None while the master has not answered."""
        self._config = config
        self._commands = commands
        self._sink = sink
        self._standing = standing
        self._wiring = wiring
        self._odometry = odometry
        self._power = power
        self._clock = clock
        self._dead_man = DeadMan(commands, config.command_timeout, clock)
        self._tally = _Tally()
        self._obeyed: Command | None = None
        self._aim = STANDSTILL
        self._slowed = False
        self._sent = STANDSTILL
        self._sent_at: float | None = None
        self._zero_since: float | None = None
        self._spent = -math.inf
        self._due = -math.inf
        self._report_due = clock()

    def greet(self) -> None:
        """Sends the velocity in force again at once, to somebody new. May be called in any thread."""
        self._due = -math.inf
        self._commands.ring()

    def step(self) -> float:
        """Sends and reports what is due. Returns the seconds until more is due."""
        command = self._dead_man.in_force()
        if command is not self._obeyed:
            self._obey(command)
            stops = self._aim == STANDSTILL and self._sent != STANDSTILL
            self._due = min(self._due, -math.inf if stops else self._spent - JITTER)
        now = self._clock()
        if self._due <= now:
            self._due = now + 1 / self._config.rate
            self._spent = max(self._spent, now) + 1 / MOST_COMMANDS
            if self._aim != STANDSTILL:
                self._zero_since = None
            elif self._zero_since is None:
                self._zero_since = now
            self._sent, self._sent_at = self._aim, now
            self._sink.send(self._aim)
        if self._report_due <= now:
            self._report_due = now + 1 / self._config.diagnostics_rate
            self._sink.report(self._report())
        expiry = self._dead_man.due() if command is not None else math.inf
        return max(0.0, min(self._due, self._report_due, expiry) - self._clock())

    def motion(self) -> Mapping[str, Any]:
        """Returns who commands the robot, and when it was last sent a zero, by the gate's clock.

        ``commanded``: m/s and rad/s. Where its driver publishes them also its battery and whether it is
        docked, and with odometry whether it stands by that, its speed and its pose: the first answers are
        ``pending``.
        """
        receivers = self._sink.receivers()
        found: dict[str, Any] = {
            "held": self._commands.held,
            "commander": self._standing().commander,
            "commanded": [self._aim.forward, self._aim.turn],
            "zero_at": self._sent_at if self._sent == STANDSTILL and receivers else None,
            "confirms": False,
            "measured": False,
            "still_since": None,
            "idle_since": self._commands.commanded_at,
            "trouble": "" if receivers else "no driver is connected with its gate",
        }
        if self._power is not None and receivers:
            found.update(self._power.state())
        if self._odometry is not None and receivers:
            self._odometry.ask()
            found.update(self._odometry.motion(self._zero_since))
        return found

    def close(self) -> None:
        """Sends the last velocity: zero."""
        self._sink.send(STANDSTILL)
        self._sink.flush()

    def _obey(self, command: Command | None) -> None:
        self._obeyed = command
        if command is None:
            self._tally.dead_man_trips += self._dead_man.expired()
            self._aim, self._slowed = STANDSTILL, False
            return
        possible = on_axes(command.velocity, self._config.motion)
        self._aim = limited(possible, self._config.motion)
        self._slowed = self._aim != possible
        self._tally.slowed += self._slowed
        self._tally.without_axis += possible != command.velocity

    def _report(self) -> Report:
        standing, wiring = self._standing(), self._wiring()
        activity = self._dead_man.activity(self._aim != STANDSTILL)
        activity += ", slowed to the robot's limits" if self._slowed else ""
        bypasses = list(wiring.bypasses()) if wiring is not None else []
        power = self._power.charge if self._power is not None else None
        complaints = [*bypasses, *([standing.complaint] if standing.complaint else [])]
        if wiring is not None and not wiring.receivers:
            output = self._config.output
            complaints.append(f"no node subscribes to {output}: commands do not reach the driver")
        complaints += power.complaints() if power is not None else []
        level = Level.ERROR if bypasses else Level.WARN if complaints else Level.OK
        level = max(level, power.level()) if power is not None else level
        return Report(level, "; ".join([activity, *complaints]), self._figures(standing, wiring))

    def _figures(self, standing: Standing, wiring: Wiring | None) -> dict[str, str]:
        seen = wiring or Wiring()
        return {
            **standing.values(),
            "refused commands": str(self._commands.refused),
            "slowed commands": str(self._tally.slowed),
            "commands on axes that the robot lacks": str(self._tally.without_axis),
            "dead-man trips": str(self._tally.dead_man_trips),
            "receivers": ", ".join(seen.receivers) or ("none" if wiring is not None else "unknown"),
            "past the gate": ", ".join([*seen.rivals, *seen.bypassing]) or "nobody",
        }


def run(
    gate: Gate, commands: CommandMailbox, latch: StopLatch, beat: Callable[[], None], longest_wait: float
) -> None:
    """Steps ``gate`` until ``commands`` are stopped, with ``beat`` after each step.

    Always ends with a zero.
    """
    try:
        while not commands.stopped:
            latch.look()
            wait = gate.step()
            beat()
            latch.answer(gate.motion)
            commands.wait(min(wait, longest_wait), latch.listens_to())
    finally:
        gate.close()
