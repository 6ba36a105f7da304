"""Drafts a spec of ROS 2 from launch files in Python, XML and YAML, and from scripts with its variables."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from swarmctl.importing.crazyflies import add_all_crazyflies
from swarmctl.importing.draft import Draft, Value
from swarmctl.importing.lab_folder import LAUNCH, OF_ROS_2, PYTHON, YAML, LabFolder, env_of, is_env_file
from swarmctl.importing.lab_hosts import EXAMPLE, LabHosts
from swarmctl.importing.launch_nodes import (
    Lab,
    not_included,
    reasons,
    unread,
    whole_folder,
)
from swarmctl.importing.unknown_values import is_secret
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.ros_packages import python_launch, xml_launch
from swarmctl.ros_packages.launch_description import Reader, evaluate
from swarmctl.ros_packages.launch_files import Launched, Place

_LIMIT = 20_000  # actions of all launch files together
_READERS: Mapping[str, Reader] = {
    PYTHON: python_launch.read,
    **dict.fromkeys(LAUNCH, xml_launch.read_xml),
    ".xml": xml_launch.read_xml,
    **dict.fromkeys((".yaml", ".yml"), xml_launch.read_yaml),
}
_SOURCED = re.compile(r"/opt/ros/(humble|jazzy|kilted|lyrical|rolling|iron|foxy|galactic)/")
DISTROS = ("humble", "jazzy", "kilted", "lyrical")
NEWEST_LTS = "jazzy"
RMW = {"rmw_fastrtps_cpp": "fastrtps", "rmw_cyclonedds_cpp": "cyclonedds", "rmw_zenoh_cpp": "zenoh"}
_SERVER_PORT = 11811
LARGEST_DOMAIN = 101
_SERVER = re.compile(r"(?:UDPv4:)?\[?([\w.-]+)\]?(?::(\d+))?")


def is_ros_2_launch(path: str, text: str) -> bool:
    """Returns True for a launch file that ROS 2 reads."""
    if path.endswith(PYTHON):
        return "generate_launch_description" in text
    if path.endswith(LAUNCH):
        return xml_launch.is_of_ros_2(text)
    return path.endswith(YAML) and "launch" in posixpath.basename(path) and "\nlaunch:" in f"\n{text}"


def is_ros_2_script(path: str, text: str) -> bool:
    """Returns True for a script or an environment file that sets variables of ROS 2."""
    return not path.endswith((*LAUNCH, PYTHON, *YAML)) and is_env_file(text, OF_ROS_2)


def draft_from_ros_2(folder: LabFolder, types: Mapping[str, AnyRobotType]) -> Draft:
    """Returns the draft from the launch files and scripts of a folder; ``types`` are the robot types."""
    launched = _launched(folder)
    lab = Lab(types, reasons(launched))
    lab.draft.source = "launch files and scripts of ROS 2"
    variables = dict(_variables(folder, lab.draft.unread))
    ros = _Ros(lab.draft, lab.hosts, variables)
    ros.add_servers()
    if not lab.draft.hosts and any(one.nodes or one.includes for one in launched.values()):
        why = "no file names a computer; write each, and which one starts what"
        lab.hosts.new("robot-pc", None, {"address": Value(EXAMPLE, fill_in=why)}, "it starts all nodes")
    elif not lab.draft.hosts and variables:
        why = "no file names a computer; write each"
        lab.hosts.new("robot-pc", None, {"address": Value(EXAMPLE, fill_in=why)}, "the script is for it")
    lab.add_nodes(launched)
    add_all_crazyflies(lab.draft, lab.hosts, folder)
    lab.draft.unread += (*lab.unknown.unread(), *unread(launched))
    if lab.draft.hosts:
        lab.draft.first = {**mode_of(lab.draft), "ros": ros.value(_distro(folder))}
    return lab.draft


def _launched(folder: LabFolder) -> Mapping[str, Launched]:
    whole, packages = whole_folder(folder)
    left, found = _LIMIT, dict[str, Launched]()
    for path in sorted(folder.candidates()):
        if is_ros_2_launch(path, folder.texts[path]):
            found[path] = evaluate(whole, path, packages, _READERS, limit=left)
            left -= found[path].cost
    return not_included(found)


def mode_of(draft: Draft) -> Mapping[str, Value]:
    """Returns the mode of hosts that share a graph without a master."""
    first = next(iter(draft.hosts))
    if len(draft.hosts) == 1:
        return {
            "mode": Value("single-minded", guess="there is one host"),
            "leader": Value(first, guess="it is the only host"),
        }
    return {
        "mode": Value("central", guess="nodes of ROS 2 share a graph, and each robot has its own mind"),
        "hub": Value(first, guess="it is the first host"),
    }


def _variables(folder: LabFolder, unread: list[str]) -> Iterator[tuple[str, Value]]:
    """The variables of all scripts; one that two scripts have with different values is the first one's."""
    found: dict[str, Value] = {}
    for path in folder.candidates():
        if is_ros_2_script(path, folder.texts[path]):
            own, why = env_of(path, folder.texts[path], OF_ROS_2)
            unread += why
            for name, value in own.items():
                before = found.setdefault(name, value)
                if before.value != value.value:
                    unread.append(f"{value.place}: {name} has another value than in {before.place}")
    yield from found.items()


def _distro(folder: LabFolder) -> Value:
    """The distribution whose setup a file sources; a guess if none does."""
    for path, text in folder.texts.items():
        for number, line in enumerate(text.split("\n"), 1):
            if (match := _SOURCED.search(line)) is None:
                continue
            if match[1] in DISTROS:
                return Value(match[1], Place(path, number))
            why = f"{path}:{number} has {match[1]}, which swarmctl does not know"
            return Value(NEWEST_LTS, guess=why)
    return Value(NEWEST_LTS, guess="no file names the distribution")


class _Ros:
    """The key `ros` of a draft, from the variables of scripts."""

    def __init__(self, draft: Draft, hosts: LabHosts, variables: Mapping[str, Value]) -> None:
        self._draft, self._hosts, self._variables = draft, hosts, variables
        self._servers: list[str] = []

    def add_servers(self) -> None:
        """Adds the hosts of discovery servers, in the order of their numbers."""
        given = self._variables.get("ROS_DISCOVERY_SERVER")
        if given is None:
            return
        places = str(given.value).split(";")
        while places and not places[-1]:
            places.pop()
        for number, one in enumerate(places):
            match = _SERVER.fullmatch(one.strip())
            if not one.strip():
                why = "is empty: the servers of a spec have the numbers 0, 1, 2, ... in its order"
                self._draft.unread.append(f"{given.place}: place {number} of ROS_DISCOVERY_SERVER {why}")
            elif match is None:
                self._draft.unread.append(f"{given.place}: `{one}` is no discovery server")
            else:
                if int(match[2] or _SERVER_PORT) != _SERVER_PORT:
                    self._draft.unread.append(
                        f"{given.place}: port {match[2]}; swarmctl takes {_SERVER_PORT}"
                    )
                name = self._hosts.find(match[1]) or self._hosts.new(
                    f"server-{len(self._servers) + 1}", given.place,
                    {"address": Value(match[1], given.place)},
                    "it runs a discovery server",
                )  # fmt: skip
                self._servers.append(name)

    def value(self, distro: Value) -> Value:
        """Returns the key `ros`, and lists what it does not have."""
        ros: dict[str, Any] = {"distro": distro.value}
        place, left = distro.place, self._draft.unread
        for name, one in self._variables.items():
            text = str(one.value)
            if name == "ROS_DOMAIN_ID" and text.isdecimal() and int(text) <= LARGEST_DOMAIN:
                ros["domain"] = int(text)
            elif name == "RMW_IMPLEMENTATION" and text in RMW:
                ros["rmw"] = RMW[text]
            elif name == "ROS_DISCOVERY_SERVER" and self._servers:
                ros["servers"] = list(dict.fromkeys(self._servers))
            elif name == "ROS_AUTOMATIC_DISCOVERY_RANGE" and text in ("LOCALHOST", "SUBNET"):
                ros["discovery"] = "local" if text == "LOCALHOST" else "multicast"
            elif name == "ROS_LOCALHOST_ONLY" and text in ("0", "1"):
                ros |= {"discovery": "local"} if text == "1" else {}
            else:
                shown = (
                    "may have a secret" if is_secret(name, text) else f"is {text}, which has no key in a spec"
                )
                left.append(f"{one.place}: {name} {shown}")
                continue
            place = place or one.place
        if ros.get("servers") and "discovery" in ros:
            left.append("discovery: the servers are kept, and not the range of discovery")
            del ros["discovery"]
        return replace(distro, value=ros, place=place)
