"""Drafts a spec of ROS 2 from Clearpath's robot.yaml, one a robot."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import yaml

from swarmctl.importing.clearpath_ros import ClearpathFile, add_ros
from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.lab_folder import LabFolder
from swarmctl.importing.lab_hosts import EXAMPLE, LabHosts
from swarmctl.importing.recognition import unknown_line
from swarmctl.importing.yaml_values import Keys, YamlValues, child_of
from swarmctl.swarm.names import robot_namespace
from swarmctl.yamltext.compose import compose, pairs_of
from swarmctl.yamltext.files import LoadBudget

_HOST_GROUPS = ("platform", "onboard", "remote")  # in files before ROS 2 Jazzy
_LEFT_OUT = ("platform", "sensors", "links", "mounts", "accessories", "manipulators")
_REASONS = {
    "system.ros2.workspaces": "a spec has `workspaces` for each host, by their folders",
    "system.ros2.middleware.override_server_id": "a server has the number of its place in `servers`",
    "system.ros2.middleware.servers": "a spec has only the hosts of servers, with `discovery: server`",
    "system.ros2.username": "the draft has that of `system`",
    "system.domain_id": "the draft has that of `ros2`",
}


def is_clearpath(root: yaml.Node | None) -> bool:
    """Returns True if the top of a YAML file is that of a robot.yaml."""
    keys = pairs_of(root).keys()
    return "system" in keys and bool(keys & {"serial_number", "platform"})


def draft_from_clearpath(folder: LabFolder, paths: Sequence[str], types: Collection[str]) -> Draft:
    """Returns the draft from each robot.yaml at ``paths`` of a folder, of robots of ``types``."""
    draft = Draft(f"the Clearpath file{'s' if paths[1:] else ''} {', '.join(paths)}")
    hosts = LabHosts(draft)
    known: dict[tuple[str, str], str] = {}  # hosts by their names and addresses there
    files: list[ClearpathFile] = []
    for path in paths:
        root, _ = compose(folder.texts[path], path, LoadBudget())
        values = YamlValues(path, root)
        file = ClearpathFile(values, child_of(root, "system"))
        _add_hosts(file, hosts, known)
        if not file.hosts:
            place = values.place(pairs_of(root)["system"][0])
            draft.unread.append(f"{place}: it names no host, so nothing of this file is in the draft")
            continue
        files.append(file)
        _add_robot(draft, file, types)
    add_ros(draft, hosts, files)
    for file in files:
        draft.unread += file.values.left(_is_section, _why_left)
    return draft


def _is_section(keys: Keys) -> bool:
    return len(keys) == 1 and keys[0] in _LEFT_OUT


def _why_left(keys: Keys) -> str:
    above = (".".join(keys[:count]) for count in range(1, len(keys) + 1))
    return next((_REASONS[one] for one in above if one in _REASONS), "")


def _add_hosts(file: ClearpathFile, hosts: LabHosts, known: dict[tuple[str, str], str]) -> None:
    """Adds the hosts of a file; one that has the name and the address of another file's is the same."""
    values = file.values
    written = list(_hosts(values, child_of(file.system, "hosts")))
    if not written:
        _add_unnamed(file, hosts)
        return
    user = values.take(file.system, "username") or values.take(file.ros, "username")
    for name, address in written:
        one = (str(name.value), str(address.value))
        if one not in known:
            fields = {"address": address, **({"user": user} if user else {})}
            known[one] = hosts.new(one[0], name.place, fields)
        elif user:
            _add_user(hosts.draft, known[one], user)
        if any(host.value == known[one] for host in file.hosts):
            places = dict.fromkeys((name.place, address.place))
            hosts.draft.unread += [f"{at}: this file has host `{known[one]}` before" for at in places]
            continue
        file.hosts.append(Value(known[one], name.place))
        file.names.setdefault(one[0], known[one])
        file.names.setdefault(one[1], known[one])


def _add_unnamed(file: ClearpathFile, hosts: LabHosts) -> None:
    """Adds the computer of a robot whose file leaves the name of its host empty."""
    serial = file.values.find(file.values.root, "serial_number")
    at, _ = pairs_of(file.system).get("hosts", (None, None))
    if serial is None or at is None:
        return
    place = file.values.place(at)
    user = file.values.take(file.system, "username") or file.values.take(file.ros, "username")
    fields = {"address": Value(EXAMPLE, fill_in=f"{place} has none"), **({"user": user} if user else {})}
    name = hosts.new(f"cpr-{serial.value}", place, fields, "Clearpath's computers are called so")
    file.hosts.append(Value(name, place))


def _add_user(draft: Draft, host: str, user: Value) -> None:
    """Adds the user of a host that another file names too; one that differs is listed."""
    old = draft.hosts[host].fields.setdefault("user", user)
    if old.value != user.value:
        why = f"{old.place} has another one, which the draft has"
        draft.unread.append(f"{user.place}: username of host `{host}`; {why}")


def _add_robot(draft: Draft, file: ClearpathFile, types: Collection[str]) -> None:
    serial = file.values.take(file.values.root, "serial_number")
    namespace = file.values.take(file.ros, "namespace")
    called = namespace or serial
    if called is None:
        why = "it has neither namespace nor serial_number, so its robot is not in the draft"
        draft.unread.append(f"{file.hosts[0].place}: {why}")
        return
    name = named(str(called.value), "robot", called.place, draft.robots)
    model = str(serial.value).partition("-")[0] if serial else "this robot"
    kind = Value(f"clearpath-{model}", serial.place if serial else None, "its serial number begins so")
    host = file.hosts[0]
    if kind.value not in types:
        why = f"swarmctl has no type for {model}; `swarmctl driver new` writes one of your own"
        kind = Value("my-robot", fill_in=f"{why} ({serial.place})" if serial else why)
        draft.lines.append(unknown_line(name.value, host.value, None, "its line, if it has one"))
    guess = "the first host of a robot.yaml is the robot's own computer"
    if others := [one for one, robot in draft.robots.items() if robot.fields["host"].value == host.value]:
        guess += f", and {', '.join(others)} names the same one"
    fields = {"type": kind, "host": Value(host.value, host.place, guess)}
    own = str(namespace.value).strip("/") if namespace else ""
    if namespace and own and robot_namespace(name.value, None) != f"/{own}":
        fields["namespace"] = Value(own, namespace.place)
    draft.robots[name.value] = Entry(name, fields)


def _hosts(values: YamlValues, hosts: yaml.Node | None) -> Iterator[tuple[Value, Value]]:
    """The names and addresses of hosts: a list since ROS 2 Jazzy, by group before."""
    for item in hosts.value if isinstance(hosts, yaml.SequenceNode) else ():
        name = values.take(item, "hostname")
        if name is not None:
            yield name, values.take(item, "ip") or Value("", name.place)
    for group in (child_of(hosts, one) for one in _HOST_GROUPS):
        for called, (key, value) in reversed(pairs_of(group).items()):
            if called and isinstance(value, yaml.ScalarNode):
                place = values.place(key)
                yield Value(called, place), values.take(group, called) or Value("", place)
