"""Writes a firmware to the board of one robot, by the agent on the robot's host."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from swarmctl.firmware import avrdude
from swarmctl.remote import agent
from swarmctl.remote.transport import HostError, Target, Transport

VERBS = ("flash",)
PATIENCE = 40.0  # s for the board to start, and its driver to hear from it
_TIMEOUT = 300.0  # s; the agent's own steps are bounded, and this is above their sum


@dataclass(frozen=True)
class Job:
    """What is written where: ``unit`` is the robot's driver, ``port`` its line, ``firmware`` Intel HEX."""

    swarm: str
    unit: str
    port: str
    firmware: bytes
    digest: str
    programmer: str = avrdude.PROGRAMMER
    speed: int = avrdude.SPEED

    def commands(self, file: str) -> list[list[str]]:
        """What is run on the host, in this order; the driver is left alone where it does not run."""
        write = avrdude.write(self.port, file, programmer=self.programmer, speed=self.speed)
        return [["systemctl", "stop", self.unit], write, ["systemctl", "start", self.unit]]


@dataclass(frozen=True)
class Flashed:
    """The board holds the firmware. ``told``: and its driver has heard it say so."""

    told: bool


def flash(job: Job, target: Target, transport: Transport, note: Callable[[str], None]) -> Flashed | HostError:
    """Carry it out; what is going on is told by ``note``."""
    request = {
        "verb": "flash",
        "swarm": job.swarm,
        "who": agent.operator(),
        "unit": job.unit,
        "port": job.port,
        "write": job.commands("{}")[1],
        "digest": job.digest,
        "patience": PATIENCE,
    }
    try:
        with transport.connect(target) as session, agent.talk(session, verbs=VERBS) as host:
            answer = host.ask(request, job.firmware, on_note=note, timeout=_TIMEOUT)
    except HostError as error:
        return error
    return Flashed(bool(answer["told"]))
