"""An e-puck with standard BTcom: what only GCtronic's firmware knows is not requested, the rest is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

import pytest
from swarm_onboard.driver.driver import Phase

from swarmctl.lab.emulators.epuck import EPuck
from tests.onboard.driver.emulated_robots import Wire
from tests.onboard.driver.fakes import Bench, Clock, config_for

ALL = {"battery": 1.0, "gyroscope": 2.0, "ground": 2.0, "light": 2.0}
TEXT = {"gyroscope": b"g\r", "battery": b"b\r"}
BINARY = {"gyroscope": b"\x99\0", "battery": b"\x9e\0", "ground": b"\xb3\0"}


class BTcom(EPuck):
    """It reads a small letter as the capital one: `b` switches the body light."""

    texts: ClassVar[Mapping[str, Callable[..., bytes]]] = {
        **EPuck.texts,
        "V": lambda robot, _: b"v,Version 2.0.0 January 2008\r\n",
        "b": EPuck.texts["B"],
        "g": EPuck.texts["G"],
    }


class Line(Wire):
    """A port on a fake clock that remembers what was sent. The second line of a version comes late."""

    def __init__(self, clock: Clock, robot: EPuck) -> None:
        super().__init__(robot)
        self.clock, self.sent = clock, list[bytes]()
        self.late = b""

    def open(self) -> Line:
        return self

    def write(self, data: bytes) -> None:
        self.sent.append(data)
        self.waiting, self.late = self.waiting + self.late, b""
        super().write(data)
        self.waiting, found, rest = self.waiting.partition(b"HW version")
        self.late = found + rest

    def read(self, timeout: float) -> bytes:
        if not self.waiting and timeout > 0:
            self.clock.now += 0.01 if self.late else timeout
            self.waiting, self.late = self.late, b""
        data, self.waiting = self.waiting, b""
        return data


def driven(type_name: str, robot: type[EPuck]) -> Bench:
    rates = {name: rate for name, rate in ALL.items() if config_for(type_name).sensor(name)}
    bench = Bench(config_for(type_name, rates=rates), robot=lambda clock: Line(clock, robot()))
    bench.run(5.0)
    assert bench.driver.phase is Phase.READY
    return bench


@pytest.mark.parametrize(("type_name", "requests"), [("epuck", TEXT), ("epuck-binary", BINARY)])
def test_queries_of_another_firmware_are_not_sent(type_name: str, requests: dict[str, bytes]) -> None:
    bench = driven(type_name, BTcom)
    assert not set(bench.robot.sent) & set(requests.values())
    assert bench.robot.robot.lights["body"] == 0
    report = bench.sink.reports[-1]
    for name in requests:
        assert f"`{name}` is left out: the firmware is not GCtronic's (Version 2.0.0" in report.message
    assert {"odom rate", "proximity rate", "light rate"} <= set(report.values)
    assert "battery rate" not in report.values


@pytest.mark.parametrize(("type_name", "requests"), [("epuck", TEXT), ("epuck-binary", BINARY)])
def test_the_firmware_that_knows_them_is_sent_all_queries(type_name: str, requests: dict[str, bytes]) -> None:
    bench = driven(type_name, EPuck)
    assert set(requests.values()) <= set(bench.robot.sent)
    report = bench.sink.reports[-1]
    assert "left out" not in report.message
    assert report.values["firmware"].startswith("Version 1.2.2 August 2008 GCtronic")
    assert report.values["failed exchanges"] == "0"
    assert bench.driver.motion()["firmware"] == report.values["firmware"]


@pytest.mark.parametrize("version", [b"", b"v,\r\n"])
def test_a_firmware_that_is_not_sent_is_none(version: bytes) -> None:
    class Nameless(EPuck):
        texts: ClassVar[Mapping[str, Callable[..., bytes]]] = {**EPuck.texts, "V": lambda robot, _: version}

    bench = driven("epuck", Nameless)
    assert bench.sink.reports[-1].values["firmware"] == "unknown"
    assert bench.driver.motion()["firmware"] == ""
