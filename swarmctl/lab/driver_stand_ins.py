"""Stand-ins for drivers of other ROS packages: which robots have one, and its files on a host.

The deployed release is that of real hosts. The disk of a lab host has a package with the name of the
vendor's, whose launch file or executable starts the stand-in; a package of a workspace comes before it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from swarmctl.lab.emulators.robot import AT_REST
from swarmctl.render import shipped_files
from swarmctl.robot_types.motion import motion_of
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.swarm import names
from swarmctl.swarm.resolved import ForeignDriver, Robot, Swarm

SHARE = "usr/share"
PACKAGE = "swarm_stand_in"
STATE_FILE = "stand_in.json"
MESSAGES = ("usr/lib/python3/dist-packages", "lib/python3/dist-packages")  # of the image, of a workspace
_MANIFEST = """<?xml version="1.0"?>
<package format="2">
  <name>{package}</name>
  <version>0.0.0</version>
  <description>A stand-in of swarmctl's lab for the package of this name.</description>
  <maintainer email="swarmctl@swarmctl.invalid">swarmctl</maintainer>
  <license>Apache-2.0</license>
</package>
"""


@dataclass(frozen=True)
class StandIn:
    """A robot without its vendor's driver: what starts it, and its configuration as JSON text.

    ``requires`` are the other packages that its driver needs, ``messages`` the packages of its messages.
    ``state`` is the file on the host with its true state.
    """

    robot: str
    host: str
    namespace: str
    package: str
    launch: str | None
    executable: str | None
    arguments: tuple[str, ...]
    state: str
    requires: tuple[str, ...]
    messages: tuple[str, ...]
    config: str

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> StandIn:
        """Returns the stand-in in JSON data that ``dataclasses.asdict`` has made."""
        tuples = {key: tuple(data.get(key, ())) for key in ("arguments", "requires", "messages")}
        return cls(**{**data, **tuples})

    @property
    def starter(self) -> str:
        """What starts the driver: package and launch file or executable."""
        return f"{self.package}/{self.launch or self.executable}"


@dataclass(frozen=True)
class StandInFile:
    """A file of a stand-in on the disk of a host."""

    path: str
    content: str
    executable: bool = False


def stand_ins_of(swarm: Swarm, emulated: Iterable[str]) -> Iterator[StandIn]:
    """Yields a stand-in for each robot whose driver is another package.

    Robots that are ``emulated``, and those whose package travels with the release, have none.
    """
    known = frozenset(emulated)
    for robot in swarm.robots.values():
        driver = robot.driver
        if not isinstance(driver, ForeignDriver) or robot.name in known:
            continue
        if driver.ros.package not in swarm.packages:
            yield _stand_in(swarm, robot, driver)


def holds(share: Path, package: str) -> bool:
    """True if a folder such as `/usr/share`, or `share` of a devel or install space, has a ROS package."""
    built = share / package / "cmake" / f"{package}Config.cmake"  # a devel space has no package.xml there
    return built.exists() or (share / package / "package.xml").exists()


def has_messages(root: Path, package: str) -> bool:
    """True if the image, or a devel or install space, has the Python messages of a package."""
    return any((root / place / package).is_dir() for place in MESSAGES)


def state_in(root: Path | None, stand_in: StandIn) -> dict[str, Any]:
    """Returns the true state of a robot as JSON data: at rest while its stand-in does not run.

    ``root`` is the root folder of the running host; None if it is off.
    """
    known: dict[str, Any] = {}
    if root is not None:
        with suppress(OSError, ValueError, TypeError):
            found = json.loads((root / stand_in.state.lstrip("/")).read_text())
            known = {key: found[key] for key in asdict(AT_REST) if key in found}
    return {**asdict(AT_REST), **known, "failure": None}


def files(stand_ins: Iterable[StandIn]) -> Iterator[StandInFile]:
    """Yields the files of the stand-ins of one host."""
    packages: dict[str, list[StandIn]] = {}
    for one in stand_ins:
        packages.setdefault(one.package, []).append(one)
        yield StandInFile(f"{SHARE}/{PACKAGE}/robots/{_config_name(one.namespace)}", one.config)
    if packages:
        yield from _node()
    needed = (package for members in packages.values() for one in members for package in one.requires)
    for package in dict.fromkeys((*packages, *needed)):
        yield StandInFile(f"{SHARE}/{package}/package.xml", _MANIFEST.format(package=package))
    for package, members in packages.items():
        yield from _starters(package, members)


def _node() -> Iterator[StandInFile]:
    for file in shipped_files.folder("stand_in"):
        place = f"{SHARE}/{PACKAGE}/{file.path.partition('/')[2]}"
        yield StandInFile(place, file.content.decode(), executable=file.mode == 0o755)


def _starters(package: str, members: Iterable[StandIn]) -> Iterator[StandInFile]:
    launched: dict[str, dict[str, None]] = {}
    executables: dict[str, None] = {}
    for one in members:
        if one.launch is not None:
            launched.setdefault(one.launch, {}).update(dict.fromkeys(one.arguments))
        elif one.executable is not None:
            executables[one.executable] = None
    for launch, arguments in launched.items():
        declared = "".join(f'  <arg name={quoteattr(name)} default="" />\n' for name in arguments)
        node = (
            f'  <node pkg="{PACKAGE}" type="stand_in.py" name="stand_in" output="screen" required="true" />\n'
        )
        yield StandInFile(f"{SHARE}/{package}/launch/{launch}", f"<launch>\n{declared}{node}</launch>\n")
    for executable in executables:
        script = f'#!/bin/sh\nexec /{SHARE}/{PACKAGE}/stand_in.py "$@"\n'
        yield StandInFile(f"{SHARE}/{package}/{executable}", script, executable=True)


def _config_name(namespace: str) -> str:
    return namespace.strip("/").replace("/", ".") + ".json"


def _stand_in(swarm: Swarm, robot: Robot, driver: ForeignDriver) -> StandIn:
    ros = driver.ros
    types = dict.fromkeys(one.type.partition("/")[0] for one in ros.publishes)
    return StandIn(
        robot=robot.name,
        host=robot.host,
        namespace=robot.namespace,
        package=ros.package,
        launch=ros.launch,
        executable=ros.executable,
        arguments=tuple(ros.arguments),
        state=f"/run/{names.runtime_folder(swarm.name, robot.name)}/{STATE_FILE}",
        requires=tuple(one for one in ros.packages if one not in {ros.package, *swarm.packages}),
        messages=tuple(one for one in types if one not in swarm.packages),
        config=json.dumps(_config(robot, driver)),
    )


def _config(robot: Robot, driver: ForeignDriver) -> Mapping[str, Any]:
    ros, kind = driver.ros, robot.type
    motion = kind.kinematics if isinstance(kind, RosRobotType) else motion_of(kind.kinematics)
    return {
        "robot": robot.name,
        "frame": ros.odometry_frame.rpartition("/")[0],
        "odom_frame": ros.odometry_frame,
        "command": ros.command,
        "command_type": ros.command_type,
        "limits": motion.axes,
        "wheel_separation": motion.wheel_separation or 0.0,
        "inputs": [one.topic for one in ros.subscribes],
        "outputs": [{"topic": one.topic, "type": one.type, "rate": one.rate or 0.0} for one in ros.publishes],
    }
