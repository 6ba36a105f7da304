"""A rover's board on the bench in virtual time: the emulated one, or the real firmware on a simulated UNO."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from swarm_onboard.driver.config import Config

from swarmctl.conformance.bench import NotStoppedError
from swarmctl.conformance.bench_runner import BOARD_CHECKS, Checks, run_checks
from swarmctl.conformance.board_bench import BoardBench
from swarmctl.conformance.results import Result, config_for
from swarmctl.lab.emulators import VirtualPort
from swarmctl.lab.emulators.arduino_rover import BUFFER, PUBLISHERS, SLOTS, SUBSCRIBERS, ArduinoRover
from swarmctl.lab.emulators.robot import NoticesPort, Robot
from swarmctl.lab.emulators.rosserial_device import TX_STOP, Device, Message, Topic
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.spec.catalog import load_catalog

SLICE = 0.005  # s; a byte is noticed as soon
LONGER = Topic("rwheel", "std_msgs/Int64", "34add168574510e6e17f5d23ecc077ef")
RANGE = "c005c34273dc426c67a020a87bc24148"
_BODY = bytes([0, 0, 2, 0, 1, 2])
OLD = (
    b"\xff\xff" + _BODY + bytes([255 - sum(_BODY) % 256]) + b"\xff" * 3
)  # rosserial 0.4: id, length, message
TYPE = with_protocol(load_catalog().types)["arduino-rover"]


@dataclass
class Line:
    """A driver's port whose time passes only while somebody waits."""

    port: VirtualPort
    received: bytes = b""

    def write(self, data: bytes) -> None:
        self.port.write(data)

    def read(self, timeout: float) -> bytes:
        end = self.port.time + timeout
        self.received += self.port.advance(0.0)
        while not self.received and self.port.time < end:
            self.received += self.port.advance(min(SLICE, end - self.port.time))
        received, self.received = self.received, b""
        return received

    def drain(self) -> None:
        self.received = b""

    def fileno(self) -> int:
        return -1

    def close(self) -> None: ...


def config(**protocol: Any) -> Config:
    """Returns the driver configuration of the rover, with changes of its protocol."""
    driver_config = config_for(TYPE, "arduino-rover", "/dev/board", None, "")
    return replace(driver_config, protocol=replace(driver_config.protocol, **protocol))


def bench_for(port: VirtualPort, driver_config: Config | None = None) -> BoardBench:
    def opened() -> Line:
        if isinstance(port.robot, NoticesPort):
            port.robot.opened()
        return Line(port)

    return BoardBench(
        driver_config or config(), opened, clock=lambda: port.time, sleep=lambda s: port.advance(s) and None
    )


def tried(robot: Robot, driver_config: Config | None = None) -> dict[str, Result]:
    """Results of all checks by name."""
    results = list(run_checks(bench_for(VirtualPort(robot), driver_config), BOARD_CHECKS))
    assert len({one.check for one in results}) == len(results)
    return {one.check: one for one in results}


def checked(
    name: str, robot: Robot, faults: Faults | None = None, driver_config: Config | None = None
) -> tuple[dict[str, Result], bool]:
    """Results of the first checks and the one called ``name``; and whether somebody knows that it stands."""
    port = VirtualPort(robot)
    port.faults = faults or Faults()
    only = Checks(BOARD_CHECKS.first, tuple(one for one in BOARD_CHECKS.others if one[0] == name))
    results: dict[str, Result] = {}
    stands = True
    try:
        for one in run_checks(bench_for(port, driver_config), only):
            assert one.check not in results
            results[one.check] = one
    except NotStoppedError:
        stands = False
    assert port.robot.state.v == 0.0
    return results, stands


class Rover(ArduinoRover):
    """The emulated rover, with the faults that sketches and their wiring are built with."""

    def __init__(self, fault: str = "", *, rate: float = 10.0, **settings: Any) -> None:
        super().__init__(rate=rate, firmware=settings.pop("firmware", "0123456789ab"), **settings)
        self.fault = fault
        self.openings = 0
        self.wedged = False
        topics = {
            "one wheel": (PUBLISHERS[:1], SUBSCRIBERS),
            "a longer number": ((PUBLISHERS[0], LONGER), SUBSCRIBERS),
            "one more": ((*PUBLISHERS, Topic("sonar", "sensor_msgs/Range", RANGE)), SUBSCRIBERS),
            "deaf": (PUBLISHERS, ()),
        }.get(fault, (PUBLISHERS, SUBSCRIBERS))  # fmt: skip
        self._device = Device(*topics, slots=SLOTS, buffer=40 if fault == "small buffers" else BUFFER)

    def opened(self) -> None:
        super().opened()
        self.openings += 1
        self.wedged = self.fault == "dead after a reset" and self.openings > 1

    def replies(self, data: bytes) -> list[bytes]:
        if self.fault == "old":
            return [OLD] if data else []
        if self.fault == "babble":
            return [b"hello\r\n"] if data else []
        broken = not data.startswith(b"\xff\xfe") or len(data) < 8 + int.from_bytes(data[2:4], "little")
        self.wedged = self.wedged or (self.fault == "wedged" and broken and self._device.connected(self._now))
        return [] if self.wedged else super().replies(data)

    def unsolicited(self) -> list[bytes]:
        sent = super().unsolicited()
        if self.fault == "one wheel silent":
            return [one for one in sent if one[5:7] != b"\x69\x00"]
        return sent

    def _take(self, message: Message) -> None:
        if self.fault == "no goodbye" and message.topic == TX_STOP:
            self._device._configured = True
        super()._take(message)

    def _drive(self, v: float, omega: float) -> None:
        left, right = v, omega
        match self.fault:
            case "sides swapped":
                omega = -omega
            case "turns the wrong way":
                v, omega = -v, -omega
            case "stands":
                v = omega = 0.0
            case "ignores zero" if left == right == 0.0:
                return
            case "slow":
                v, omega = 0.6 * v, 0.6 * omega
        super()._drive(v, omega)
