"""Drafts a spec of ROS 2 from Clearpath's robot.yaml, one a robot."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import yaml

from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.lab_folder import LabFolder
from swarmctl.importing.lab_hosts import LabHosts
from swarmctl.importing.launch_nodes import unknown_line
from swarmctl.ros_packages.launch_files import Place
from swarmctl.yamltext.compose import compose, pairs_of
from swarmctl.yamltext.files import LoadBudget

_HOST_GROUPS = ("platform", "onboard", "remote")  # in files before ROS 2 Jazzy
_HUMBLE, _JAZZY = "humble", "jazzy"
_LEFT_OUT = ("platform", "sensors", "links", "mounts", "accessories", "manipulators")


def is_clearpath(root: yaml.Node | None) -> bool:
    """Returns True if the top of a YAML file is that of a robot.yaml."""
    keys = pairs_of(root).keys()
    return "system" in keys and bool(keys & {"serial_number", "platform"})


def draft_from_clearpath(folder: LabFolder, paths: Sequence[str], types: Collection[str]) -> Draft:
    """Returns the draft from each robot.yaml at ``paths`` of a folder, of robots of ``types``."""
    draft = Draft(f"the Clearpath file{'s' if paths[1:] else ''} {', '.join(paths)}")
    hosts = LabHosts(draft)
    known: dict[tuple[str, str], str] = {}  # hosts by their names and addresses there
    for path in paths:
        root, _ = compose(folder.texts[path], path, LoadBudget())
        system = _child(root, "system")
        ros = _child(system, "ros2")
        user = _scalar(path, system, "username") or _scalar(path, ros, "username")
        found: list[Value] = []
        for name, address in _hosts(path, _child(system, "hosts")):
            one = (str(name.value), str(address.value))
            if one not in known:
                fields = {"address": address, **({"user": user} if user else {})}
                known[one] = hosts.new(one[0], name.place, fields)
            found.append(Value(known[one], name.place))
        serial = _scalar(path, root, "serial_number")
        if found and (called := _scalar(path, ros, "namespace") or serial):
            _add_robot(draft, called, serial, found[0], types)
        _add_ros(draft, path, system, found)
        draft.unread += _unread(path, root)
    return draft


def _add_ros(draft: Draft, path: str, system: yaml.Node | None, hosts: Sequence[Value]) -> None:
    """The first file decides: all hosts of a swarm have one distribution and one domain."""
    at, group = pairs_of(system).get("hosts", (None, None))
    if at is None or not hosts or draft.first:
        return
    distro = _JAZZY if isinstance(group, yaml.SequenceNode) else _HUMBLE
    ros: dict[str, object] = {"distro": distro}
    domain = _scalar(path, system, "domain_id") or _scalar(path, _child(system, "ros2"), "domain_id")
    if domain is not None and str(domain.value).isdecimal():
        ros["domain"] = int(domain.value)
    why = f"its hosts are written as files of {distro.title()} have them"
    draft.first = {
        "mode": Value("central", guess="nodes of ROS 2 share a graph, and each robot has its own mind"),
        "hub": replace(hosts[0], guess="it is the first host"),
        "ros": Value(ros, Place(path, at.start_mark.line + 1), why),
    }


def _add_robot(
    draft: Draft, called: Value, serial: Value | None, host: Value, types: Collection[str]
) -> None:
    name = named(str(called.value), "robot", called.place, draft.robots)
    model = str(serial.value).partition("-")[0] if serial else "this robot"
    kind = Value(f"clearpath-{model}", serial.place if serial else None, "its serial number begins so")
    if kind.value not in types:
        why = f"swarmctl has no type for {model}; `swarmctl driver new` writes one of your own"
        kind = Value("my-robot", fill_in=why)
        draft.lines.append(unknown_line(name.value, host.value, None, "its line, if it has one"))
    guess = "the first host of a robot.yaml is the robot's own computer"
    if others := [one for one, robot in draft.robots.items() if robot.fields["host"].value == host.value]:
        guess += f", and {', '.join(others)} names the same one"
    on = Value(host.value, host.place, guess)
    draft.robots[name.value] = Entry(name, {"type": kind, "host": on})


def _hosts(path: str, hosts: yaml.Node | None) -> Iterator[tuple[Value, Value]]:
    """The names and addresses of hosts: a list since ROS 2 Jazzy, by group before."""
    for item in hosts.value if isinstance(hosts, yaml.SequenceNode) else ():
        name = _scalar(path, item, "hostname")
        if name is not None:
            yield name, _scalar(path, item, "ip") or Value("", name.place)
    for group in (_child(hosts, one) for one in _HOST_GROUPS):
        for called, (key, _) in reversed(pairs_of(group).items()):
            place = Place(path, key.start_mark.line + 1)
            yield Value(called, place), _scalar(path, group, called) or Value("", place)


def _unread(path: str, root: yaml.Node | None) -> Iterator[str]:
    for key, (node, value) in reversed((pairs_of(root) | pairs_of(_child(root, "system"))).items()):
        place = Place(path, node.start_mark.line + 1)
        if key == "ros2":
            yield f"{place}: of `ros2` only namespace, username and domain are kept"
        elif key in _LEFT_OUT and value.value:
            yield f"{place}: a spec has no key for {key}"


def _child(node: yaml.Node | None, key: str) -> yaml.Node | None:
    return pairs_of(node).get(key, (None, None))[1]


def _scalar(path: str, node: yaml.Node | None, key: str) -> Value | None:
    at, value = pairs_of(node).get(key, (None, None))
    if at is None or not isinstance(value, yaml.ScalarNode) or not value.value:
        return None
    return Value(value.value, Place(path, at.start_mark.line + 1))
