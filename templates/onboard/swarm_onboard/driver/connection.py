"""What a driver needs of one open port and the robot behind it, independent of the protocol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Protocol, Sequence

from swarm_onboard.command.battery_watch import BatteryWatch
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.kinematics import Odometry
from swarm_onboard.driver.session import Sink
from swarm_onboard.driver.tally import Tally

UNKNOWN = "unknown"  # a firmware that the robot has not named
FIRST_RETRY, LAST_RETRY = 0.2, 5.0  # s between two attempts to connect, doubled from the one to the other


@dataclass(frozen=True)
class ConnectionContext:
    """What all connections of one driver work with."""

    config: Config
    commands: CommandMailbox
    outputs: ActuatorSettings
    sink: Sink
    tally: Tally
    battery: BatteryWatch
    clock: Callable[[], float]


class Readable(Protocol):
    """What a thread may wait for, such as a port that sends unsolicited data."""

    def fileno(self) -> int:
        """Returns the file descriptor."""


class Connection(Protocol):
    """Begins and ends with a stop. ``step``, ``stop`` and ``send_stop`` raise LinkLostError or PortError.

    ``since``: when the robot was known and stood; none until then and while it is lost. ``trouble``: why.
    """

    trouble: str
    firmware: str

    @property
    def since(self) -> float | None:
        """When the robot was known and stood; None until then."""

    @property
    def odometry(self) -> Odometry:
        """The pose and the counters it was computed from."""

    def step(self) -> float:
        """Does what is due. Returns the moment at which more is."""
        ...

    def listens_to(self) -> Sequence[Readable]:
        """Returns the files whose input calls for a step before that moment."""
        ...

    def take(self, config: Config) -> None:
        """Works with the live values of ``config`` from the next step on."""

    def stop(self) -> None:
        """Stops the robot, and confirms it where the protocol can."""
        ...

    def send_stop(self) -> None:
        """Sends the stop and waits for no reply: the last bytes on a line that is given up."""
        ...

    def close(self) -> None:
        """Closes the port."""

    def activity(self) -> str:
        """Returns what the robot is doing, as text for people."""
        ...

    def zero_at(self) -> float | None:
        """Returns when a zero was last sent, confirmed where the protocol can.

        None while the robot may have another speed.
        """
        ...

    def wheel_step(self) -> float | None:
        """Returns the way of a wheel from one count to the next, in m; None if the wheels are not read."""
        ...

    def rates(self) -> list[tuple[str, float, float]]:
        """Returns name, measured and wanted rate of everything that arrives regularly, in Hz."""
        ...

    def complaints(self) -> list[str]:
        """Returns the faults of a connected robot."""
        ...

    def figures(self) -> dict[str, str]:
        """Returns more values for the diagnostics, by name."""
