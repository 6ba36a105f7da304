"""A driver and a board that speaks rosserial, on a clock that only moves when both have nothing to do."""

from __future__ import annotations

from dataclasses import replace

from swarm_onboard.command.report import Report
from swarm_onboard.driver.driver import Phase
from swarm_onboard.driver.port import PortError

from tests.onboard.driver.fakes import Bench, Clock, config_for
from tests.onboard.rosserial.compiled_sketch import Sketch

STILL = (0.0, 0.0)


class BoardBench(Bench):
    """The board speaks when it likes, and wakes the driver by that."""

    def __init__(self, **settings) -> None:
        config = config_for("arduino-rover", **settings)
        config = replace(config, protocol=replace(config.protocol, firmware="0123456789ab"))
        super().__init__(config, robot=plugged_sketch)

    def run(self, seconds: float, *, at_most: int = 5_000) -> None:
        end = self.clock.now + seconds
        for _ in range(at_most):
            self.robot.live()
            due = self.clock.now + self.driver.step()
            if self.driver.listens_to() and self.robot.waiting:
                continue
            due = min(due, self.robot.due())
            if due >= end:
                self.clock.now = end
                return
            self.clock.now = max(self.clock.now, due) + 1e-6
        raise AssertionError(f"{at_most} steps in {seconds} s: the driver is spinning")

    def keep_commanding(self, seconds: float, linear: float = 0.2, angular: float = 0.0) -> None:
        for _ in range(round(seconds / 0.1)):
            self.command(linear, angular)
            self.run(0.1)

    @property
    def sent(self) -> list[tuple[float, float]]:
        return [(linear, angular) for _, linear, angular in self.robot.commands]

    @property
    def report(self) -> Report:
        return self.sink.reports[-1]


def plugged_sketch(clock: Clock) -> Sketch:
    return Sketch(clock, PortError)


def ready(**settings) -> BoardBench:
    bench = BoardBench(**settings)
    bench.run(4.0)
    assert bench.driver.phase is Phase.READY, bench.sink.events
    return bench
