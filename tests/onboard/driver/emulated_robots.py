"""A driver's real codec and link, and at the other end an emulated robot, which knows the manual only."""

from __future__ import annotations

from swarm_onboard.driver.codec import Values
from swarm_onboard.driver.config import Config
from swarm_onboard.driver.polled_robot import linked
from swarm_onboard.driver.tally import Tally

from swarmctl.lab.emulators import emulator
from swarmctl.lab.emulators.emulator_lookup import EMULATED_AS
from swarmctl.lab.emulators.robot import Robot
from tests.onboard.driver.fakes import config_for


class Wire:
    """A port that is the emulated robot itself."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.waiting = b""
        self.now = 0.0

    def write(self, data: bytes) -> None:
        self.waiting += self.robot.receive(data)

    def read(self, timeout: float) -> bytes:
        if not self.waiting:
            self.now += timeout
        data, self.waiting = self.waiting, b""
        return data

    def drain(self) -> None:
        self.waiting = b""

    def close(self) -> None:
        """Nothing to let go of."""


class Emulated:
    """One robot of a type: its driver's parameters, and what it reads."""

    def __init__(self, type_name: str, config: Config | None = None, **scene: object) -> None:
        self.robot = emulator(EMULATED_AS.get(type_name, type_name), **scene)
        self.config = config or config_for(type_name)
        self.tally = Tally()
        self.wire = Wire(self.robot)
        self.link = linked(self.wire, self.config.protocol, self.tally, lambda: self.wire.now)

    def set_up(self) -> None:
        for request in self.link.codec.setup():
            self.link.ask(request)

    def read(self, sensor_name: str) -> Values:
        """The raw numbers of one sensor, as the driver takes them from the reply."""
        sensor = self.config.sensor(sensor_name)
        values = self.link.ask(self.link.codec.query(sensor.read)).values
        return values[sensor.first : sensor.first + sensor.count]

    def set(self, actuator_name: str, *values: int) -> None:
        [actuator] = [one for one in self.config.actuators if one.name == actuator_name]
        for index in range(1 if actuator.at_once else len(values)):
            self.link.ask(self.link.codec.actuator(actuator, index, values))
