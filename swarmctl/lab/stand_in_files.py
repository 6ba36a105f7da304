"""The files of stand-ins on a lab host, where its ROS finds them.

The deployed release is that of real hosts. The disk of a lab host has a package with the name of the
vendor's, whose launch file or executable starts the stand-in; a package of a workspace comes before it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from swarmctl.lab.driver_stand_ins import LAUNCHER, StandIn, is_ros2, share
from swarmctl.render import shipped_files

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
