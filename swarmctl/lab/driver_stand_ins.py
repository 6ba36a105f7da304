"""Stand-ins for drivers of other ROS packages: which robots have one, its configuration, its true state.

The deployed release is that of real hosts. The disk of a lab host has a package with the name of the
vendor's, whose launch file or executable starts the stand-in; a package of a workspace comes before it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from swarmctl.lab.emulators.robot import AT_REST
from swarmctl.render import shipped_files
from swarmctl.render.middleware import middleware_of
from swarmctl.robot_types.kinematics import motion_of
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.swarm import names
from swarmctl.swarm.resolved import ForeignDriver, Robot, Swarm

STATE_FILE = "stand_in.json"
LAUNCHER = "ros2launch"  # the package of `ros2 launch`
# Of the image with either ROS, of a workspace.
MESSAGES = (
    *("usr/lib/python3/dist-packages", "opt/ros/*/lib/python3.*/site-packages"),
    "lib/python3/dist-packages",
)


@dataclass(frozen=True)
class StandIn:
    """A robot without its vendor's driver: what starts it, and its configuration as JSON text.

    ``namespace_argument`` is that of its launch file which takes the namespace; empty if swarmctl sets it.
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
    namespace_argument: str
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


def is_ros2(distro: str) -> bool:
    """True for a distribution of ROS 2."""
    return "domains" in middleware_of(distro).capabilities


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


def share(distro: str) -> str:
    """Returns the folder of the image in which ROS looks for packages."""
    return f"opt/ros/{distro}/share" if is_ros2(distro) else "usr/share"


def holds(share: Path, package: str) -> bool:
    """True if a folder such as `/usr/share`, or `share` of a devel or install space, has a ROS package."""
    built = share / package / "cmake" / f"{package}Config.cmake"  # a devel space has no package.xml there
    return built.exists() or (share / package / "package.xml").exists()


def has_messages(root: Path, package: str) -> bool:
    """True if the image, or a devel or install space, has the Python messages of a package."""
    return any(any(root.glob(f"{place}/{package}")) for place in MESSAGES)


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


def _stand_in(swarm: Swarm, robot: Robot, driver: ForeignDriver) -> StandIn:
    ros, ros2 = driver.ros, is_ros2(swarm.distro_of(robot.host))
    types = dict.fromkeys(one.type.partition("/")[0] for one in ros.publishes)
    launcher = (LAUNCHER,) if ros.launch is not None and ros2 else ()
    needed = (*ros.packages, *launcher)
    return StandIn(
        robot=robot.name,
        host=robot.host,
        namespace=robot.namespace,
        package=ros.package,
        launch=ros.launch,
        executable=ros.executable,
        arguments=tuple(ros.arguments),
        namespace_argument=ros.namespace_argument or "",
        state=f"/run/{names.runtime_folder(swarm.name, robot.name)}/{STATE_FILE}",
        requires=tuple(one for one in needed if one not in {ros.package, *swarm.packages}),
        messages=tuple(one for one in types if one not in swarm.packages),
        config=json.dumps(_config(robot, driver, names.ros2_name if ros2 else str)),
    )


def _config(robot: Robot, driver: ForeignDriver, name: Callable[[str], str]) -> Mapping[str, Any]:
    """``name``: writes a topic as this ROS does."""
    ros, kind = driver.ros, robot.type
    motion = kind.kinematics if isinstance(kind, RosRobotType) else motion_of(kind.kinematics)
    return {
        "robot": robot.name,
        "frame": ros.odometry_frame.rpartition("/")[0],
        "odom_frame": ros.odometry_frame,
        "command": name(ros.command),
        "command_type": ros.command_type,
        "limits": motion.axes,
        "wheel_separation": motion.wheel_separation or 0.0,
        "inputs": [(name(one.topic), one.type) for one in ros.subscribes],
        "outputs": [
            {"topic": name(one.topic), "type": one.type, "rate": one.rate or 0.0} for one in ros.publishes
        ],
    }


PACKAGE = "swarm_stand_in"
FOLDER = f"usr/share/{PACKAGE}"  # in ROS 1, also that of its ROS package
_MANIFEST = """<?xml version="1.0"?>
<package format="2">
  <name>{package}</name>
  <version>0.0.0</version>
  <description>A stand-in of swarmctl's lab for the package of this name.</description>
  <maintainer email="swarmctl@swarmctl.invalid">swarmctl</maintainer>
  <license>Apache-2.0</license>
</package>
"""

_SCRIPT = f'#!/bin/sh\nexec /{FOLDER}/stand_in.py "$@"\n'
#: A launch file of a vendor in ROS 2: the command ``ros2`` of the lab knows it by this text.
_IN_PLACE = f"<!-- In the lab, the node of {PACKAGE} runs in place of this launch file. -->\n"


@dataclass(frozen=True)
class StandInFile:
    """A file of a stand-in on the disk of a host."""

    path: str
    content: str
    executable: bool = False


def files(stand_ins: Iterable[StandIn], distro: str) -> Iterator[StandInFile]:
    """Yields the files of the stand-ins of one host with this ``distro`` of ROS."""
    ros2, place = is_ros2(distro), share(distro)
    packages: dict[str, list[StandIn]] = {}
    for one in stand_ins:
        packages.setdefault(one.package, []).append(one)
        yield StandInFile(f"{FOLDER}/robots/{_config_name(one.namespace)}", one.config)
    if packages:
        yield from _node("ros2" if ros2 else "ros1")
    needed = dict.fromkeys(
        (
            *packages,
            *(package for members in packages.values() for one in members for package in one.requires),
        )
    )
    for package in needed:
        yield StandInFile(f"{place}/{package}/package.xml", _MANIFEST.format(package=package))
        if ros2:
            yield StandInFile(f"{place}/ament_index/resource_index/packages/{package}", "")
    if LAUNCHER in needed:
        command = shipped_files.text("lab/ros2_launch.py").decode()
        yield StandInFile(f"opt/ros/{distro}/bin/ros2", command, executable=True)
    for package, members in packages.items():
        for launch, (arguments, of_namespace) in _launched(members).items():
            in_place = f"{_IN_PLACE}namespace argument: {of_namespace}\n" if of_namespace else _IN_PLACE
            content = in_place if ros2 else _launch_file(arguments, of_namespace)
            yield StandInFile(f"{place}/{package}/launch/{launch}", content)
        folder = f"opt/ros/{distro}/lib/{package}" if ros2 else f"{place}/{package}"
        for executable in dict.fromkeys(one.executable for one in members if one.launch is None):
            yield StandInFile(f"{folder}/{executable}", _SCRIPT, executable=True)


def _node(face: str) -> Iterator[StandInFile]:
    for file in shipped_files.folder("stand_in", face):
        path = f"{FOLDER}/{file.path.partition('/')[2]}"
        yield StandInFile(path, file.content.decode(), executable=file.mode == 0o755)


def _launched(members: Iterable[StandIn]) -> dict[str, tuple[dict[str, None], str]]:
    """The launch files of a package, with the arguments that robots give them, and that of the namespace."""
    found: dict[str, tuple[dict[str, None], str]] = {}
    for one in members:
        if one.launch is not None:
            arguments, _ = found.setdefault(one.launch, ({}, one.namespace_argument))
            arguments.update(dict.fromkeys(one.arguments))
    return found


def _launch_file(arguments: Iterable[str], of_namespace: str) -> str:
    declared = "".join(f'  <arg name={quoteattr(name)} default="" />\n' for name in arguments)
    space = f" ns={quoteattr(f'$(arg {of_namespace})')}" if of_namespace else ""
    node = (
        f'<node pkg="{PACKAGE}" type="stand_in.py" name="stand_in"{space} output="screen" required="true" />'
    )
    return f"<launch>\n{declared}  {node}\n</launch>\n"


def _config_name(namespace: str) -> str:
    return namespace.strip("/").replace("/", ".") + ".json"
