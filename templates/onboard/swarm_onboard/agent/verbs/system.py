"""``system``: what is in no release and may make a trial differ: kernel, hardware, packages, firmwares."""

from __future__ import annotations

import os
import sys

from swarm_onboard.agent import hardware, packages, platforms, robot_motion
from swarm_onboard.agent.hardware import UsbDevice
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.texts import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Sequence

_ANSWERS_WITHIN = 1.0  # s for drivers


class Request(NamedTuple):
    """``requires`` as for ``observe``; ``robots``: those of the host, each with its port (empty: none)."""

    swarm: str
    requires: Sequence[str]
    robots: dict[str, str]


class Answer(NamedTuple):
    """``platform``: as in ``platforms.platform``; ``kernel``: release and version, as uname(2) has them;
    ``model``: of the board or computer, empty if unknown; ``packages``: the version of each that is there and
    has one; ``ports``: the device of each robot's that is there; ``firmware``: by robot, as far as it has
    sent it to its driver."""

    platform: str
    python: str
    kernel: str
    model: str
    devices: list[UsbDevice]
    packages: dict[str, str]
    ports: dict[str, str]
    firmware: dict[str, str]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the host's system, and what it knows of its robots'."""
    home = home_of(request.swarm)
    machine = os.uname()
    places = packages.found(request.requires, home.outside)
    versions = {
        one[len(packages.PACKAGE) :]: platforms.version(home.outside(f"{path}/package.xml"))
        for one, path in places.items()
        if path and one.startswith(packages.PACKAGE)
    }
    ports = {robot: hardware.port(path, home.outside) for robot, path in request.robots.items() if path}
    sockets = {one: path for one, path in robot_motion.sockets(home).items() if one in request.robots}
    answers = robot_motion.ask(sockets, _ANSWERS_WITHIN, lambda found: len(found) == len(sockets))
    return Answer(
        platforms.platform(home.outside),
        sys.version.split()[0],
        f"{machine.release} {machine.version}",
        hardware.model(home.outside),
        hardware.usb_devices(home.outside),
        {name: version for name, version in versions.items() if version},
        {robot: path for robot, path in ports.items() if path},
        {robot: clipped(one["firmware"]) for robot, one in answers.items() if one.get("firmware")},
    )
