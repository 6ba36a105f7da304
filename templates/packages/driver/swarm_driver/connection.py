"""What a driver needs of one open port and the robot behind it, whatever is spoken there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Protocol, Sequence

from swarm_driver.actuators import ActuatorSettings
from swarm_driver.command_mailbox import CommandMailbox
from swarm_driver.config import Config
from swarm_driver.kinematics import Odometry
from swarm_driver.report import Tally
from swarm_driver.session import Sink


@dataclass(frozen=True)
class ConnectionContext:
    """What all connections of one driver work with."""

    config: Config
    commands: CommandMailbox
    outputs: ActuatorSettings
    sink: Sink
    tally: Tally
    clock: Callable[[], float]


class Readable(Protocol):
    """What may be waited for, as a port that speaks unasked."""

    def fileno(self) -> int: ...


class Connection(Protocol):
    """Begins and ends with a stop. ``step``, ``stop`` and ``send_stop`` raise LinkLostError or PortError.

    ``since``: when the robot was known and stood; none until then and while it is lost. ``trouble``: why.
    """

    trouble: str
    firmware: str

    @property
    def since(self) -> float | None: ...

    @property
    def odometry(self) -> Odometry: ...

    def step(self) -> float:
        """Do what is due; the moment at which more is."""
        ...

    def listens_to(self) -> Sequence[Readable]:
        """What calls for a step before that moment."""
        ...

    def stop(self) -> None:
        """Stop the robot, so well as what is spoken there can make sure of it."""
        ...

    def send_stop(self) -> None:
        """Sends the stop and waits for no reply: the last bytes on a line that is given up."""
        ...

    def close(self) -> None: ...

    def activity(self) -> str:
        """What the robot is doing, in words."""
        ...

    def rates(self) -> list[tuple[str, float, float]]:
        """Name, measured and wanted rate of everything that comes regularly, in Hz."""
        ...

    def complaints(self) -> list[str]:
        """Faults of a connected robot; one that was reported is not reported again."""
        ...

    def figures(self) -> dict[str, str]: ...
