"""Drafts a spec from an Ansible inventory and the variables beside it."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

from swarmctl.importing.draft import Draft, Entry, Value
from swarmctl.importing.inventory import Variables, inventory
from swarmctl.importing.known_drivers import type_of_group
from swarmctl.importing.lab_folder import LabFolder
from swarmctl.importing.lab_hosts import EXAMPLE, LabHosts, address_of, number
from swarmctl.importing.robot_lines import unknown_line
from swarmctl.importing.secret_names import is_secret
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.ros_packages.launched import Place
from swarmctl.swarm.addresses import means_self
from swarmctl.swarm.names import valid_name

_COMPUTED = re.compile(r"\{[{%#]")  # of Jinja
# Keys of a host, an example of each, and the variables that have them; the first that is set counts.
_HOST_KEYS: Mapping[str, tuple[object, tuple[str, ...]]] = {
    "address": (EXAMPLE, ("ansible_host", "ansible_ssh_host")),
    "user": ("robot", ("ansible_user", "ansible_ssh_user")),
    "port": (22, ("ansible_port", "ansible_ssh_port")),
}
_OF_HOSTS = {one for _, names in _HOST_KEYS.values() for one in names}
_MASTER = ("ros_master_uri", "ROS_MASTER_URI")
_OTHERS = {"ansible_connection", "robot_type", *_MASTER}
_SSH = {"ssh", "smart", "paramiko", "paramiko_ssh"}
_OF_SSH = re.compile(r"ansible_(ssh_)?private_key_file|ansible_ssh_\w*args")


def draft_from_inventory(folder: LabFolder, path: str, types: Mapping[str, RobotType]) -> Draft:
    """Returns the draft from the inventory file at ``path`` of a folder; ``types`` are the robot types.

    Raises ``InventoryError``.
    """
    found, place = inventory(folder.texts, path), Place(path, 0)
    draft = Draft(f"the Ansible inventory {path}")
    hosts = LabHosts(draft)
    names: dict[str, str] = {}  # in the spec, by those in the inventory
    for name, variables in found.hosts.items():
        if why := _no_host(name, variables):
            draft.unread.append(f"{path}: host `{name}`: {why}")
        else:
            names[name] = hosts.new(name, place, _fields(name, variables, place))
    for name, key in names.items():
        uri = _first(found.hosts[name], _MASTER)
        if uri and not _COMPUTED.search(uri):
            hosts.add_master([key], Value(uri, place))
        kind = _robot_type(found.hosts[name], found.groups[name], types, place)
        if kind is not None:
            robot = Value(key, place, "one robot is driven by this host")
            draft.robots[key] = Entry(robot, {"type": kind, "host": Value(key, place)})
            draft.lines.append(unknown_line(key, key, types[kind.value]))
    groups: dict[str, list[str]] = {}
    for name, key in names.items():
        for group in found.groups[name]:
            if group not in ("all", "ungrouped"):
                groups.setdefault(valid_name(group, "group"), []).append(key)
    if groups:
        draft.last["groups"] = Value(groups, place)
    draft.unread += [f"{one}: the whole file is encrypted by ansible-vault" for one in found.encrypted]
    draft.unread += [f"{path}: {one}" for one in _left_out({name: found.hosts[name] for name in names})]
    return draft


def _first(variables: Variables, names: Collection[str]) -> str:
    """The first variable that has a text."""
    return next((text for name in names if (text := variables.get(name))), "")


def _no_host(name: str, variables: Variables) -> str:
    """Says why swarmctl cannot log into a host by SSH; empty if it can."""
    connection = (variables.get("ansible_connection") or "ssh").rpartition(".")[2]
    own = _first(variables, _HOST_KEYS["address"][1]) or name
    if connection == "local" or means_self(own):
        this = "ansible_connection=local" if connection == "local" else own
        return f"`{this}` is the computer that runs Ansible; add it as a host if robots depend on it"
    return "" if connection in _SSH else f"it is reached by {connection}, and a host needs Linux and SSH"


def _fields(name: str, variables: Variables, place: Place) -> Mapping[str, Value]:
    fields = {"address": address_of(name, place)}  # what Ansible connects to without another one
    for key, (example, names) in _HOST_KEYS.items():
        variable = next((one for one in names if one in variables), "")
        if variable:
            text = variables[variable]
            if why := _unusable(variable, text):
                fields[key] = Value(example, fill_in=f"{variable} {why}")
            else:
                fields[key] = Value(number(text or "") if key == "port" else text, place)
    return fields


def _unusable(variable: str, text: str | None) -> str:
    """Says why the value of a variable is not taken; empty if it is."""
    if text is None:
        return "is encrypted"
    if is_secret(variable, text):
        return "may be a secret"
    return "is computed by a template" if _COMPUTED.search(text) else ""


def _left_out(hosts: Mapping[str, Variables]) -> Sequence[str]:
    """Says which variables of hosts are not in the draft, and why."""
    found: dict[tuple[str, str], list[str]] = {}
    for name, variables in hosts.items():
        for variable, text in variables.items():
            why = _unusable(variable, text)
            if _OF_SSH.fullmatch(variable):
                why = "belongs in ~/.ssh/config; a jump host is `via`"
            elif variable not in _OF_HOSTS | _OTHERS:
                why = why or "has no key in a spec"
            elif variable in _OF_HOSTS:
                why = ""  # it is to fill in
            if why:
                found.setdefault((variable, why), []).append(name)
    return [
        f"{variable} of host `{names[0]}`{f' and {len(names) - 1} more' if names[1:] else ''} {why}"
        for (variable, why), names in found.items()
    ]


def _robot_type(
    variables: Variables, groups: Sequence[str], types: Collection[str], place: Place
) -> Value | None:
    """The type of the robot that a host carries, if its variable or the name of a group says so."""
    named = variables.get("robot_type")
    if named in types:
        return Value(named, place)
    found = next((kind for one in reversed(groups) if (kind := type_of_group(one, types))), "")
    return Value(found, place, "its host is in a group that is named like this type") if found else None
