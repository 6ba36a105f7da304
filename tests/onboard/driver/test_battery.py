"""A driver warns of a battery that is nearly empty."""

from __future__ import annotations

from swarm_onboard.command.report import Level

from tests.onboard.driver.fakes import Bench


def test_a_battery_that_is_nearly_empty_is_a_warning() -> None:
    bench = Bench()
    bench.run(3.0)
    assert bench.sink.reports[-1].level is Level.OK
    bench.robot.battery = 560  # 11.2 V of 11 to 13
    bench.run(3.0)
    report = bench.sink.reports[-1]
    assert report.level is Level.WARN
    assert report.message.endswith("; the battery is at 10%")
