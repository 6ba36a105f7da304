"""Results of checks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from swarm_onboard.driver.config import Config, parse

from swarmctl.robot_types.driver_params import params_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import RobotSettings, merged


def config_for(robot_type: RobotType, name: str, port: str, baud: int | None, module: str) -> Config:
    """Returns the driver configuration of a robot type, without commanders."""
    params = params_of(
        robot_type, robot=name, namespace=f"/{name}", port=port, baud=baud, module=module,
        settings=_with_tuned_sensors(robot_type),
    )  # fmt: skip
    return parse({**params, "commanders": []})


def config_of(params: Mapping[str, Any], port: str, baud: int | None, module: str) -> Config:
    """Returns the driver configuration of a robot of a swarm, with another port and without commanders."""
    serial = {**params["serial"], **({"baud": baud} if baud else {})}
    protocol = {**params["protocol"], **({"module": module} if "module" in params["protocol"] else {})}
    return parse({**params, "port": port, "serial": serial, "protocol": protocol, "commanders": []})


def _with_tuned_sensors(robot_type: RobotType) -> RobotSettings:
    """Returns the type's settings with every sensor on that has settings of its own: off, it is not set."""
    rates = {name: 1.0 for name, one in robot_type.sensors.items() if one.settings_key}
    return merged(robot_type.settings, RobotSettings(rates=rates))


class Verdict(Enum):
    """The result of one check."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Result:
    """One line of the table: the check, its verdict, the figure, how to fix it, and the bytes it received."""

    check: str
    verdict: Verdict
    figure: str = ""
    fix: str = ""
    received: bytes | None = None  # of the exchange that failed

    def to_json(self) -> dict[str, Any]:
        """Returns the entry of ``driver test --json``."""
        known = {key: value for key, value in asdict(self).items() if key != "received"}
        received = {} if self.received is None else {"received": self.received.hex(" ")}
        return known | received | {"verdict": self.verdict.value}


def ok(check: str, figure: str) -> Result:
    """Returns the result of a check that passed."""
    return Result(check, Verdict.OK, figure)


def warn(check: str, figure: str, fix: str = "") -> Result:
    """Returns a warning, which does not fail the test."""
    return Result(check, Verdict.WARN, figure, fix)


def fail(check: str, figure: str, fix: str = "", received: bytes | None = None) -> Result:
    """Returns the result of a check that failed."""
    return Result(check, Verdict.FAIL, figure, fix, received)


def passed(results: Iterable[Result]) -> bool:
    """Returns whether no result is a failure."""
    return all(one.verdict is not Verdict.FAIL for one in results)
