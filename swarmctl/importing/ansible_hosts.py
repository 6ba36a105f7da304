"""Drafts a spec from an Ansible inventory and the variables beside it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from swarmctl.importing.allowed_values import is_allowed, is_secret, name_fact, number, valid_name
from swarmctl.importing.arrangement_of_masters import arrangement, networks
from swarmctl.importing.draft import Blank, Draft, Entry, Fact, Field, Unread
from swarmctl.importing.env_files import OWN, is_ip, master_of
from swarmctl.importing.inventory import Variable, Variables, inventory
from swarmctl.importing.known_drivers import type_of_group
from swarmctl.importing.lab_folder import LabFolder
from swarmctl.importing.robot_lines import unknown_line
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.ros_packages.launched import Place

_COMPUTED = re.compile(r"\{[{%#]")  # of Jinja
# Keys of a host, and the variables that have them; the first that is set counts.
_HOST_KEYS: Mapping[str, tuple[str, ...]] = {
    "address": ("ansible_host", "ansible_ssh_host"),
    "user": ("ansible_user", "ansible_ssh_user"),
    "port": ("ansible_port", "ansible_ssh_port"),
}
_OF_HOSTS = frozenset(one for names in _HOST_KEYS.values() for one in names)
_EXAMPLES = {"address": "192.168.77.11", "user": "robot", "port": 22}
_KEY_FILES = ("ansible_ssh_private_key_file", "ansible_private_key_file")
_CONNECTIONS = ("ansible_connection", "connection")
_SSH = {"", "ssh", "smart", "paramiko", "paramiko_ssh"}
_HERE = "is the computer that runs Ansible; add it as a host if robots depend on it"
_WINDOWS = {"winrm", "psrp"}
_SSH_OPTIONS = ("ansible_ssh_common_args", "ansible_ssh_extra_args", "ansible_ssh_args")
_MASTER = ("ros_master_uri", "ROS_MASTER_URI")
_TYPE = ("robot_type", "swarmctl_type")
_READ = {
    *_KEY_FILES,
    *_CONNECTIONS,
    *_MASTER,
    *_TYPE,
    *(one for names in _HOST_KEYS.values() for one in names),
}


@dataclass(frozen=True)
class _Host:
    """A host as the inventory calls it, its entry, its groups and the variables that hold for it."""

    name: str
    entry: Entry
    groups: tuple[str, ...]
    variables: Variables


def draft_from_inventory(folder: LabFolder, path: str, types: Mapping[str, RobotType]) -> Draft:
    """Returns the draft from the inventory file at ``path`` of a folder; ``types`` are the robot types.

    Raises ``InventoryError``.
    """
    found, place = inventory(folder.texts, path), Place(path, 0)
    unread = list(found.unread)
    hosts: list[_Host] = []
    for name, variables in found.hosts.items():
        if why := _no_host(name, variables):
            unread.append(Unread(place, f"host `{name}`: {why}"))
        else:
            entry = _entry(name, place, variables, {one.entry.key for one in hosts})
            hosts.append(_Host(name, entry, found.groups[name], variables))
    notes = Counter(note for one in hosts for note in one.entry.notes)
    common = tuple(note for note, count in notes.items() if count > 1)
    entries = [_without(one.entry, common) for one in hosts]
    masters, others = _masters(hosts, place)
    entries += others
    robots = tuple(_robots(hosts, types))
    arranged = arrangement([one.key for one in entries], masters, ())
    lines = [unknown_line(one.key, one.key, types.get(one.value("type"))) for one in robots]
    return Draft(
        f"the Ansible inventory {path}",
        Fact("lab", None, "an inventory has no name"),
        arranged.first,
        tuple(entries),
        robots,
        (*networks(entries), *lines),
        last={**arranged.last, **_groups(hosts, place)},
        unread=tuple(dict.fromkeys((*folder.unread, *unread, *_without_key(hosts, place)))),
        notes=common,
    )


def _groups(hosts: Collection[_Host], place: Place) -> Mapping[str, Field]:
    """The groups of the inventory, with their hosts, as those of a spec."""
    found: dict[str, list[str]] = {}
    for host in hosts:
        for group in host.groups:
            if group not in ("all", "ungrouped"):
                found.setdefault(valid_name(group, "group"), []).append(host.entry.key)
    return {"groups": Fact(found, place)} if found else {}


def _without(entry: Entry, common: Collection[str]) -> Entry:
    return replace(entry, notes=tuple(note for note in entry.notes if note not in common))


def _first(variables: Mapping[str, Variable], names: Collection[str]) -> Variable | None:
    return next((variables[name] for name in names if name in variables), None)


def _no_host(name: str, variables: Variables) -> str:
    """Says why swarmctl cannot log into a host by SSH; empty if it can."""
    found = _first(variables, _CONNECTIONS)
    connection = found.value.rpartition(".")[2] if found else ""
    shell = variables.get("ansible_shell_type")
    if connection in _WINDOWS or (shell and shell.value in {"powershell", "cmd"}):
        return "it runs Windows, and a host needs Linux with systemd"
    if connection == "local":
        return f"`connection=local` {_HERE}"
    address = _first(variables, _HOST_KEYS["address"])
    if (own := address.value if address else name) in OWN:
        return f"`{own}` {_HERE}"
    return "" if connection in _SSH else "it is not reached by SSH"


def _entry(name: str, place: Place, variables: Variables, taken: Collection[str]) -> Entry:
    fields: dict[str, Field] = {}
    for key, names in _HOST_KEYS.items():
        found = next((one for one in names if one in variables), "")
        if found:
            fields[key] = _field(key, found, variables[found], place)
        elif key == "address":
            fields[key] = _address(name, place)
    short = name if is_ip(name) else name.partition(".")[0]
    host = name_fact(short, "host", place, taken)
    was = name if host.value != name else ""
    return Entry(replace(host, was=was), fields, tuple(_notes(variables)))


def _field(key: str, variable: str, one: Variable, place: Place) -> Field:
    value = number(one.value) if key == "port" else one.value
    if not one.is_vault and not is_secret(variable, one.value) and is_allowed(key, value):
        return Fact(value, place)
    why = "is computed by a template" if _COMPUTED.search(one.value) else f"is no {key} that a spec takes"
    return Blank(_EXAMPLES[key], f"{variable} {'is encrypted' if one.is_vault else why}")


def _address(name: str, place: Place) -> Field:
    if is_allowed("address", name):
        return Fact(name, place)  # what Ansible connects to
    return Blank(_EXAMPLES["address"], "there is no ansible_host, and the host's name is not an address")


def _notes(variables: Variables) -> Iterator[str]:
    """Comments about what is left out: secrets by their key, and the key file, which ssh has to know."""
    for key, one in sorted(variables.items()):
        if one.is_vault or is_secret(key, one.value):
            yield f"left out: {key}, which may be a secret"
    found = _first(variables, _KEY_FILES)
    if found is not None and not _COMPUTED.search(found.value):
        yield f"key file {found.value}: write it as IdentityFile in ~/.ssh/config"


def _without_key(hosts: Collection[_Host], place: Place) -> Iterator[Unread]:
    """Variables that a spec has no key for, or whose value a template computes."""
    unknown: dict[str, list[str]] = {}
    for host in hosts:
        for key, one in host.variables.items():
            if key in _READ and key not in _OF_HOSTS and _COMPUTED.search(one.value):
                yield Unread(place, f"{key} is computed by a template")
            elif key in _SSH_OPTIONS:
                yield Unread(place, f"{key}: a jump host is `via`; other options belong in ~/.ssh/config")
            elif key not in _READ and not one.is_vault and not is_secret(key, one.value):
                unknown.setdefault(key, []).append(host.name)
    for key, (first, *more) in unknown.items():
        others = f" and {len(more)} more" if more else ""
        yield Unread(place, f"a spec has no key for {key} of host `{first}`{others}")


def _masters(hosts: Collection[_Host], place: Place) -> tuple[Mapping[str, Fact], Sequence[Entry]]:
    """By host, the host of its ROS master, and the masters' hosts that the inventory does not have."""
    known = {str(one.entry.value("address")): one.entry.key for one in hosts}
    known |= {name: one.entry.key for one in hosts for name in (one.entry.key, one.name)}
    masters: dict[str, Fact] = {}
    others: list[Entry] = []
    for host in hosts:
        uri = _first(host.variables, _MASTER)
        address = (master_of(uri.value) or ("", 0))[0] if uri else ""
        if uri is None or not is_allowed("address", address):
            continue
        if address not in known and address not in OWN:
            short = "master" if is_ip(address) else address.partition(".")[0]
            taken = {*known.values()}
            why = "ROS_MASTER_URI names this computer, and the inventory does not"
            entry = Entry(name_fact(short, "host", place, taken, why), {"address": Fact(address, place)})
            known[address] = entry.key
            others.append(entry)
        masters[host.entry.key] = Fact(host.entry.key if address in OWN else known[address], place)
    return masters, others


def _robots(hosts: Collection[_Host], types: Collection[str]) -> Iterator[Entry]:
    """A robot for each host whose variable or group says which type it carries."""
    for host in hosts:
        type_fact = _robot_type(host, types)
        if type_fact is not None:
            key = host.entry.key
            name = Fact(key, host.entry.name.place, "one robot is driven by this host")
            yield Entry(name, {"type": type_fact, "host": Fact(key, host.entry.name.place)})


def _robot_type(host: _Host, types: Collection[str]) -> Fact | None:
    found = _first(host.variables, _TYPE)
    if found is not None and found.value in types:
        return Fact(found.value, host.entry.name.place)
    for group in reversed(host.groups):
        if name := type_of_group(group, types):
            return Fact(name, host.entry.name.place, "its host is in a group that is named like this type")
    return None
