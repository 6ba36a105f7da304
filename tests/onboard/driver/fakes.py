"""A clock that stands still, a robot at the end of a fake port, and a sink that remembers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.report import Level, Report
from swarm_onboard.driver.actuators import ActuatorSettings
from swarm_onboard.driver.codec import Values
from swarm_onboard.driver.config import Config, Sensor, parse
from swarm_onboard.driver.driver import Driver
from swarm_onboard.driver.kinematics import Pose
from swarm_onboard.driver.live_parameters import LiveParameters
from swarm_onboard.driver.port import PortError
from swarm_onboard.driver.relay import Outgoing, Parameter
from swarm_onboard.rosserial.topics import MessageType, Topic

from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import params_of
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.spec.catalog import load_catalog

#: Whom a robot of these tests obeys, as its parameter file says it.
TESTER = {
    "name": "tester",
    "priority": 0,
    "nodes": ["/tester"],
    "namespace": None,
    "hosts": ["192.168.77.10"],
    "addresses": [],
}
#: Every type that our own driver asks.
TYPES = ("koala", "koala-2.5", "khepera3", "epuck", "epuck-binary", "epuck2")


def ros_name(type_name: str) -> str:
    """A robot called as its type, as far as ROS allows that."""
    return type_name.translate(str.maketrans("-.", "__"))


def params_for(
    type_name: str, port: str = "/dev/robot", commanders: Any = (TESTER,), **settings: Any
) -> dict[str, Any]:
    params = params_of(
        with_protocol(load_catalog().types)[type_name],
        robot=ros_name(type_name),
        namespace=f"/{ros_name(type_name)}",
        port=port,
        settings=RobotSettings.model_validate(settings),
    )
    return {**params, "commanders": list(commanders)}


def config_for(type_name: str, port: str = "/dev/robot", **settings: Any) -> Config:
    return parse(params_for(type_name, port, **settings))


class Clock:
    """Time that passes only when somebody waits."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class FakeKoala:
    """A Koala that answers at once, or misbehaves as its attributes say. It is its own port."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.plugged = True
        self.silent_to = ""  # first letters of requests that get no reply
        self.refuses = ""  # first letters of requests that get an error
        self.cuts_short = ""  # first letters of requests whose reply breaks off
        self.garble = b""  # sent instead of every reply
        self.takes = 0.0  # seconds for a reply
        self.counters = (0, 0)
        self.battery = 600  # steps of 20 mV
        self.waiting = b""  # sent, and not read yet
        self.requests: list[tuple[float, str]] = []
        self.opened = 0
        self.tried: list[float] = []
        self.speed = (0, 0)

    def open(self) -> FakeKoala:
        self.tried.append(self.clock.now)
        if not self.plugged:
            raise PortError("/dev/robot is missing", missing=True)
        self.opened += 1
        self.waiting = b"Koala BIOS says hello\r\n"
        return self

    def write(self, data: bytes) -> None:
        self._check()
        request = data.decode().strip()
        self.requests.append((self.clock.now, request))
        if request.startswith("D,"):
            _, left, right = request.split(",")
            self.speed = (int(left), int(right))
        if request[0] in self.silent_to:
            return
        reply = self.garble or self._reply(request)
        self.waiting += reply[: len(reply) // 2] if request[0] in self.cuts_short else reply

    def read(self, timeout: float) -> bytes:
        self._check()
        if timeout <= 0:
            return b""
        if not self.waiting:
            self.clock.now += timeout
        self.clock.now += self.takes
        data, self.waiting = self.waiting, b""
        return data

    def drain(self) -> None:
        self._check()
        self.waiting = b""

    def close(self) -> None:
        """Nothing to let go of."""

    def speed_requests(self) -> list[str]:
        return [request for _, request in self.requests if request.startswith("D,")]

    def _reply(self, request: str) -> bytes:
        if request[0] in self.refuses:
            return b"z,Protocol error\r\n"
        numbers = {
            "H": ",{},{}".format(*self.counters),
            "N": "," + ",".join(["7"] * 16),
            "B": ",5,1",
            "M": f",{self.battery}",
        }.get(request[0], "")
        return (request[0].lower() + numbers + "\r\n").encode()

    def _check(self) -> None:
        if not self.plugged:
            raise PortError("/dev/robot is gone", absent=True)


class Memory:
    """A sink that keeps everything."""

    def __init__(self) -> None:
        self.poses: list[Pose] = []
        self.readings: list[tuple[str, Values]] = []
        self.reports: list[Report] = []
        self.events: list[tuple[Level, str]] = []

    def odometry(self, pose: Pose) -> None:
        self.poses.append(pose)

    def reading(self, sensor: Sensor, values: Values) -> None:
        self.readings.append((sensor.name, values))

    def report(self, report: Report) -> None:
        self.reports.append(report)

    def event(self, level: Level, text: str) -> None:
        self.events.append((level, text))


class FakeRelay:
    """ROS as a board sees it: knows some types, remembers what it is given, has what a test puts in."""

    def __init__(self) -> None:
        self.types = {
            "std_msgs/Int32": MessageType("da5909fbe378aeaf85e547e830cc1bb7", 4),
            "geometry_msgs/Twist": MessageType("9f195f881246fdfa2798d1d3eebca84a", 48),
        }
        self.served: list[Topic] = []
        self.published: list[tuple[str, bytes]] = []
        self.logged: list[tuple[int, str]] = []
        self.requested: list[str] = []
        self.mail: list[Outgoing | Parameter] = []

    def type_of(self, name: str) -> MessageType | None:
        return self.types.get(name)

    def serve(self, topics: Sequence[Topic]) -> None:
        self.served = list(topics)

    def publish(self, topic: Topic, message: bytes) -> None:
        self.published.append((topic.name, message))

    def log(self, level: int, text: str) -> None:
        self.logged.append((level, text))

    def ask(self, name: str) -> None:
        self.requested.append(name)

    def taken(self) -> list[Outgoing | Parameter]:
        mail, self.mail = self.mail, []
        return mail


class Bench:
    """A driver with a fake Koala, or another robot, on a fake clock."""

    def __init__(self, config: Config | None = None, robot: Callable[[Clock], Any] = FakeKoala) -> None:
        self.clock = Clock()
        self.robot = robot(self.clock)
        self.sink = Memory()
        self.relay = FakeRelay()
        self.commands = CommandMailbox(self.clock)
        self.config = config or config_for("koala")
        self.outputs = ActuatorSettings(self.config.actuators, self.commands.ring, self.clock)
        self.driver = Driver(
            self.config,
            self.commands,
            self.sink,
            self.outputs,
            self.relay,
            open_port=self.robot.open,
            clock=self.clock,
            jitter=lambda: 1.0,
        )
        self.live = LiveParameters(self.config, self.driver.take, lambda: None, self.commands.ring)

    def command(self, linear: float, angular: float = 0.0) -> None:
        self.commands.put((linear, 0.0, 0.0), (0.0, 0.0, angular))

    def run(self, seconds: float, *, at_most: int = 20_000) -> None:
        """Let time pass, as ``driver.run`` does."""
        end = self.clock.now + seconds
        for _ in range(at_most):
            wait = self.driver.step()
            if self.clock.now + wait >= end:
                self.clock.now = max(end, self.clock.now)
                return
            self.clock.now += wait
        raise AssertionError(f"{at_most} steps in {seconds} s: the driver is spinning")
