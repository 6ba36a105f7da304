"""Faults of a robot: its cable, the robot itself, the process of its driver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from swarmctl.lab.errors import LabError
from swarmctl.lab.faults.fault_kind import FaultKind, FaultOption, RunningLab
from swarmctl.lab.faults.host_faults import percent

if TYPE_CHECKING:
    from swarmctl.lab.lab_plan import LabPlan


def kill_script(swarm: str, robot: str) -> str:
    """Returns the script that kills the main process of a driver's unit."""
    return f"systemctl kill --signal=KILL --kill-who=main swarm-{swarm}.{robot}.service"


def _host_of(plan: LabPlan, robot: str) -> str:
    hosts = {one.robot: one.host for one in plan.stand_ins} | {one.name: one.host for one in plan.robots}
    if robot not in hosts:
        raise LabError(f"lab {plan.name} has no robot `{robot}`", f"it has {', '.join(hosts) or 'none'}")
    return hosts[robot]


def _unplug(lab: RunningLab, robot: str, _: Any) -> str:
    lab.ask("unplug", lab.plan.robot(robot).name)
    return "cable disconnected"


def _stall(lab: RunningLab, robot: str, _: Any) -> str:
    lab.ask("stall", lab.plan.robot(robot).name)
    return "does not answer"


def _drain(lab: RunningLab, robot: str, level: float) -> str:
    lab.ask("battery", f"{lab.plan.robot(robot).name} {level / 100:g}")
    return f"battery at {level:g} %"


def _kill(lab: RunningLab, robot: str, _: Any) -> str:
    lab.in_host(_host_of(lab.plan, robot), kill_script(lab.plan.swarm, robot))
    return "driver killed"


def _plug(lab: RunningLab, robots: Sequence[str]) -> None:
    _ask_for_emulated(lab, "plug", robots)


def _resume(lab: RunningLab, robots: Sequence[str]) -> None:
    _ask_for_emulated(lab, "resume", robots)


def _recharge(lab: RunningLab, robots: Sequence[str]) -> None:
    _ask_for_emulated(lab, "recharge", robots)


def _ask_for_emulated(lab: RunningLab, verb: str, robots: Sequence[str]) -> None:
    for robot in lab.plan.robots:
        if robot.emulator and robot.name in robots:
            lab.ask(verb, robot.name)


def _restarted(lab: RunningLab, robots: Sequence[str]) -> None:
    """Nothing: systemd starts the driver again."""


UNPLUG = FaultKind(
    "unplug",
    "Disconnect the cables of robots. The robots keep executing their last commands.",
    _unplug,
    _plug,
    of_robots=True,
)
STALL = FaultKind(
    "stall",
    "Have robots take no command and answer none. They keep executing the last one; their cables stay.",
    _stall,
    _resume,
    of_robots=True,
)
BATTERY = FaultKind(
    "battery",
    "Set how full the batteries of robots are.",
    _drain,
    _recharge,
    of_robots=True,
    option=FaultOption("percent", "N", "How full they are, in percent.", percent),
)
KILL = FaultKind(
    "kill",
    "Kill the drivers of robots (SIGKILL of the main process).",
    _kill,
    _restarted,
    of_robots=True,
)
