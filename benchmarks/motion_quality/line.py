"""An emulated robot on a serial line in virtual time: bytes take their time at the baud rate."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from swarm_onboard.driver.config import Serial

from swarmctl.lab.emulators import Robot
from swarmctl.lab.emulators.robot import NoticesPort
from swarmctl.lab.emulators.virtual_time import VirtualPort

SOON = 1e-5  # s; the shortest period of reading unsolicited output
ADAPTER = 0.016  # s for which a USB adapter of FTDI keeps an answer back, as it comes out of the box


class Clock:
    """Time that passes only when somebody waits."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class TimedLine:
    """What a driver's link needs of a port. The robot lives exactly as long as the clock says."""

    def __init__(self, robot: Robot, serial: Serial, clock: Clock) -> None:
        self._port = VirtualPort(robot)
        if isinstance(robot, NoticesPort):
            robot.opened()
        self._byte = (1 + serial.bytesize + (serial.parity != "none") + serial.stopbits) / serial.baud
        self._clock = clock
        self._sent: deque[tuple[float, bytes]] = deque()  # and when the robot has it all
        self._answered: deque[tuple[float, bytes]] = deque()  # and when the host has it

    def write(self, data: bytes) -> None:
        self.catch_up()
        begun = max(self._clock.now, self._sent[-1][0] if self._sent else 0.0)
        self._sent.append((begun + len(data) * self._byte, data))

    def read(self, timeout: float) -> bytes:
        """What has arrived, after waiting for it at most ``timeout`` seconds."""
        self.catch_up()
        end = self._clock.now + timeout
        while not self._arrived() and self._clock.now < end:
            self._clock.now = min([end, *self._moments()])
            self.catch_up()
        data = bytearray()
        while self._arrived():
            data += self._answered.popleft()[1]
        return bytes(data)

    def drain(self) -> None:
        self.read(0.0)

    def close(self) -> None:
        """Nothing to let go of."""

    def catch_up(self) -> None:
        """Let the robot live until now; it takes each request when its last byte is there."""
        while self._sent and self._sent[0][0] <= self._clock.now:
            moment, data = self._sent.popleft()
            self._live(moment)
            self._port.write(data)
            self._live(moment)
        self._live(self._clock.now)

    def _live(self, moment: float) -> None:
        answer = self._port.advance(max(0.0, moment - self._port.time))
        if answer:
            self._answered.append((self._port.time + len(answer) * self._byte + ADAPTER, answer))

    def _moments(self) -> Iterator[float]:
        """When something comes next that can be foreseen."""
        yield from (each[0][0] for each in (self._sent, self._answered) if each)
        yield self._port.time + max(SOON, self._port.robot.unsolicited_due())

    def _arrived(self) -> bool:
        return bool(self._answered) and self._answered[0][0] <= self._clock.now
