"""Drafts a spec from a Clearpath robot.yaml: its hosts. Its platform and ROS 2 have no place in a spec."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import yaml

from swarmctl.importing.allowed_values import is_allowed, name_fact
from swarmctl.importing.arrangement_of_masters import arrangement, networks
from swarmctl.importing.draft import Blank, Draft, Entry, Fact, Field, Unread
from swarmctl.importing.lab_folder import LabFolder
from swarmctl.importing.robot_lines import unknown_line
from swarmctl.importing.yaml_trees import pairs, tree_of
from swarmctl.ros_packages.launched import Place
from swarmctl.spec.model import Mode

_HOST_GROUPS = ("platform", "onboard", "remote")  # in files before ROS 2 Jazzy
_LEFT_OUT = {
    "platform": "a spec has no platforms; the robot's type is to fill in",
    "sensors": "sensors belong to a robot type",
    "links": "a spec describes no bodies",
    "mounts": "a spec describes no bodies",
    "accessories": "a spec describes no bodies",
    "manipulators": "swarmctl drives no arms",
}


@dataclass(frozen=True)
class _Named:
    name: str
    place: Place
    address: str
    address_place: Place


def is_clearpath(root: yaml.Node | None) -> bool:
    """Returns True if the top of a YAML file is that of a robot.yaml."""
    keys = {key for key, _, _ in pairs(root)}
    return "system" in keys and bool(keys & {"serial_number", "platform"})


def draft_from_clearpath(folder: LabFolder, path: str) -> Draft:
    """Returns the draft from the robot.yaml at ``path`` of a folder."""
    root = tree_of(path, folder.texts[path])
    if isinstance(root, Unread):
        return Draft(path, Fact("lab", None, "the file cannot be read"), unread=(root,))
    system, ros = _child(root, "system"), _child(_child(root, "system"), "ros2")
    user = _scalar(path, system, "username") or _scalar(path, ros, "username")
    hosts: list[Entry] = []
    for one in _named(path, _child(system, "hosts")):
        fields: dict[str, Field] = {"address": _address(one)}
        if user is not None and is_allowed("user", user.value):
            fields["user"] = user
        hosts.append(Entry(name_fact(one.name, "host", one.place, {host.key for host in hosts}), fields))
    serial = _scalar(path, root, "serial_number")
    robots = _robot(hosts, _scalar(path, ros, "namespace") or serial, serial)
    lines = [unknown_line(one.key, hosts[0].key, None, "its line, if it has one") for one in robots]
    return Draft(
        f"the Clearpath file {path}",
        Fact("lab", None, "a robot.yaml has no name for a swarm"),
        _mode([one.key for one in hosts]),
        tuple(hosts),
        robots,
        (*networks(hosts), *lines),
        unread=tuple(_unread(path, root, system)),
    )


def _mode(hosts: list[str]) -> Mapping[str, Field]:
    if len(hosts) == 1:
        return arrangement(hosts, {}, ()).first
    return {"mode": Fact(Mode.STANDALONE.value, None, "the file is of ROS 2, which has no master")}


def _address(host: _Named) -> Field:
    if is_allowed("address", host.address):
        return Fact(host.address, host.address_place)
    return Blank("192.168.131.1", f"{host.address_place} has no usable address")


def _robot(hosts: list[Entry], name: Fact | None, serial: Fact | None) -> tuple[Entry, ...]:
    if name is None or not hosts:
        return ()
    model = str(serial.value).partition("-")[0] if serial else "this robot"
    why = f"swarmctl has no type for {model}; `swarmctl driver new` writes one of your own"
    host = Fact(
        hosts[0].key, hosts[0].name.place, "the first host of a robot.yaml is the robot's own computer"
    )
    return (
        Entry(
            name_fact(str(name.value), "robot", name.place, ()),
            {"type": Blank("my-robot", why), "host": host},
        ),
    )


def _named(path: str, hosts: yaml.Node | None) -> Iterator[_Named]:
    """The hosts, as a list since ROS 2 Jazzy and by group before."""
    for item in hosts.value if isinstance(hosts, yaml.SequenceNode) else ():
        name, address = _scalar(path, item, "hostname"), _scalar(path, item, "ip")
        if name is not None and name.place is not None:
            yield _Named(
                name.value,
                name.place,
                address.value if address else "",
                address.place if address and address.place else name.place,
            )
    for group in _HOST_GROUPS if isinstance(hosts, yaml.MappingNode) else ():
        for name_there, value, line in pairs(_child(hosts, group)):
            place = Place(path, line)
            yield _Named(name_there, place, value.value if isinstance(value, yaml.ScalarNode) else "", place)


def _unread(path: str, root: yaml.Node | None, system: yaml.Node | None) -> Iterator[Unread]:
    for key, _, line in pairs(system):
        if key == "ros2":
            yield Unread(Place(path, line), "the namespace alone is kept: swarmctl sets up ROS 1, not ROS 2")
    for key, value, line in pairs(root):
        if key in _LEFT_OUT and value.value:
            yield Unread(Place(path, line), f"{key}: {_LEFT_OUT[key]}")


def _child(node: yaml.Node | None, key: str) -> yaml.Node | None:
    return next((value for name, value, _ in pairs(node) if name == key), None)


def _scalar(path: str, node: yaml.Node | None, key: str) -> Fact | None:
    for name, value, line in pairs(node):
        if name == key and isinstance(value, yaml.ScalarNode) and value.value:
            return Fact(str(value.value), Place(path, line))
    return None
