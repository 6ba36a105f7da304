"""Drafts a spec from Clearpath's robot.yaml, one a robot: their platforms and ROS 2 have no place in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import yaml

from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.lab_folder import LabFolder
from swarmctl.importing.lab_hosts import LabHosts, address_of
from swarmctl.importing.robot_lines import unknown_line
from swarmctl.ros_packages.launched import Place
from swarmctl.yamltext.compose import compose, pairs_of
from swarmctl.yamltext.limits import LoadBudget

_HOST_GROUPS = ("platform", "onboard", "remote")  # in files before ROS 2 Jazzy
_LEFT_OUT = ("platform", "sensors", "links", "mounts", "accessories", "manipulators")


def is_clearpath(root: yaml.Node | None) -> bool:
    """Returns True if the top of a YAML file is that of a robot.yaml."""
    keys = pairs_of(root).keys()
    return "system" in keys and bool(keys & {"serial_number", "platform"})


def draft_from_clearpath(folder: LabFolder, paths: Sequence[str]) -> Draft:
    """Returns the draft from each robot.yaml at ``paths`` of a folder."""
    draft = Draft(f"the Clearpath file{'s' if paths[1:] else ''} {', '.join(paths)}")
    hosts = LabHosts(draft)
    known: dict[tuple[str, str], str] = {}  # hosts by their names and addresses there
    for path in paths:
        root, _ = compose(folder.texts[path], path, LoadBudget())
        system, ros = _child(root, "system"), _child(root, "system", "ros2")
        user = _scalar(path, system, "username") or _scalar(path, ros, "username")
        keys: list[str] = []
        for name, address in _hosts(path, _child(system, "hosts")):
            one = (str(name.value), str(address.value))
            if one not in known and name.place is not None:
                known[one] = hosts.new(
                    one[0], name.place, {"address": address, **({"user": user} if user else {})}
                )
            keys.append(known[one])
        serial = _scalar(path, root, "serial_number")
        if keys and (called := _scalar(path, ros, "namespace") or serial):
            _add_robot(draft, called, str(serial.value) if serial else "this robot", keys[0])
        draft.unread += _unread(path, root)
    return draft


def _add_robot(draft: Draft, called: Value, serial: str, host: str) -> None:
    name = named(str(called.value), "robot", called.place, draft.robots)
    model = serial.partition("-")[0]
    why = f"swarmctl has no type for {model}; `swarmctl driver new` writes one of your own"
    first = "the first host of a robot.yaml is the robot's own computer"
    draft.robots[name.value] = Entry(
        name,
        {
            "type": Value("my-robot", fill_in=why),
            "host": Value(host, draft.hosts[host].name.place, first),
        },
    )
    draft.lines.append(unknown_line(name.value, host, None, "its line, if it has one"))


def _hosts(path: str, hosts: yaml.Node | None) -> Iterator[tuple[Value, Value]]:
    """The names and addresses of hosts: a list since ROS 2 Jazzy, by group before."""
    for item in hosts.value if isinstance(hosts, yaml.SequenceNode) else ():
        name, address = _scalar(path, item, "hostname"), _scalar(path, item, "ip")
        if name is not None and name.place is not None:
            yield name, address or address_of("", name.place)
    for group in _HOST_GROUPS:
        for name_there, (key, _) in reversed(pairs_of(_child(hosts, group)).items()):
            place = Place(path, key.start_mark.line + 1)
            address = _scalar(path, _child(hosts, group), name_there)
            yield Value(name_there, place), address or address_of("", place)


def _unread(path: str, root: yaml.Node | None) -> Iterator[str]:
    for key, (node, value) in reversed((pairs_of(root) | pairs_of(_child(root, "system"))).items()):
        place = Place(path, node.start_mark.line + 1)
        if key == "ros2":
            yield f"{place}: the namespace alone is kept: swarmctl sets up ROS 1, not ROS 2"
        elif key in _LEFT_OUT and value.value:
            yield f"{place}: a spec has no key for {key}"


def _child(node: yaml.Node | None, *keys: str) -> yaml.Node | None:
    for key in keys:
        _, node = pairs_of(node).get(key, (None, None))
    return node


def _scalar(path: str, node: yaml.Node | None, key: str) -> Value | None:
    pair = pairs_of(node).get(key)
    if pair is None or not isinstance(pair[1], yaml.ScalarNode) or not pair[1].value:
        return None
    return Value(pair[1].value, Place(path, pair[0].start_mark.line + 1))
