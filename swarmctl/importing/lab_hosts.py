"""The hosts of a lab, from <machine> elements and the ROS variables of its scripts."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from swarmctl.importing.allowed_values import is_allowed, name_fact, number, valid_name
from swarmctl.importing.draft import Blank, Entry, Fact, Field, Unread
from swarmctl.importing.env_files import OWN, Written, is_ip, master_of
from swarmctl.ros_packages.launched import Machine, Place

_GENERAL = {"setup", "env", "environment", "ros", "bashrc", "ros-env", "ros-setup", "local-setup"}
_SUFFIX = re.compile(r"[-_](env|environment|setup|ros|bashrc)$")  # of scripts: k3_env.sh
_ROS_PORT = 11311


@dataclass(frozen=True)
class Mention:
    """What one place says about a host."""

    name: str
    address: str
    place: Place
    fields: Mapping[str, Field] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    guess: str = ""  # why it is called so


@dataclass
class LabHosts:
    """The hosts as their mentions are collected. A host is known by its address or by its name."""

    entries: dict[str, Entry] = field(default_factory=dict)
    machines: dict[str, str] = field(default_factory=dict)  # hosts by the names of roslaunch
    folders: dict[str, set[str]] = field(default_factory=dict)  # hosts by the folders of their scripts
    names: dict[str, str] = field(default_factory=dict)  # hosts by each of their names and addresses
    masters: dict[str, Fact] = field(default_factory=dict)  # the host of each host's master
    default: str = ""  # the host of nodes that name no machine
    unread: list[Unread] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add_machine(self, machine: Machine) -> None:
        """Adds the computer of a <machine>."""
        name, address, place = machine.name, machine.address, machine.place
        if name is None or address is None:
            self.unread.append(Unread(place, "the host only knows the name or the address of this machine"))
            return
        values = {"user": machine.user, "port": number(machine.port or "")}
        fields = {key: Fact(one, place) for key, one in values.items() if one and is_allowed(key, one)}
        notes = (f"left out: password of {place}, which may be a secret",) if machine.has_password else ()
        self.machines[name] = self.add(Mention(name, address, place, fields, notes))
        self.names.setdefault(name, self.machines[name])
        if machine.is_default:
            self.default = self.machines[name]

    def add_script(self, path: str, env: Mapping[str, Written]) -> str:
        """Adds the host that the variables of a script are for; returns its name, empty if they name none."""
        ip, named = env.get("ROS_IP"), env.get("ROS_HOSTNAME")
        own = ip or named
        if own is None or own.value in OWN:
            return ""
        folder, file = posixpath.split(path)
        stem = _SUFFIX.sub("", file.partition(".")[0])
        called = posixpath.basename(folder) if valid_name(stem, "host") in _GENERAL else stem
        if named is not None and not is_ip(named.value):
            host = self.add(Mention(_short(named.value), own.value, own.place))
        elif called:
            host = self.add(Mention(called, own.value, own.place, guess=f"its script is {path}"))
        else:
            host = self.add(Mention(own.value, own.value, own.place))
        self.folders.setdefault(folder, set()).add(host)
        return host

    def add_master(self, hosts: list[str], uri: Written) -> None:
        """Adds the master that hosts use, and the master's own host if it is not known yet."""
        master = master_of(uri.value)
        if master is None:
            self.unread.append(Unread(uri.place, "ROS_MASTER_URI names no host"))
            return
        address, port = master
        if address not in OWN:
            name = self.add(Mention("master" if is_ip(address) else _short(address), address, uri.place))
            hosts = [*hosts, name]
        for host in hosts:
            hub = host if address in OWN else name
            self.masters.setdefault(host, Fact(hub, uri.place))
            if port != _ROS_PORT:
                fields = {**self.entries[hub].fields, "master_port": Fact(port, uri.place)}
                self.entries[hub] = replace(self.entries[hub], fields=fields)

    def add(self, mention: Mention) -> str:
        """Adds a host, or what is new about one that is known; returns its name in the spec."""
        known = self.known(mention.name if mention.address in OWN else mention.address)
        if not known:
            named = self.known(mention.name)
            known = "" if named and mention.guess and self.entries[named].name.guess else named
        if known:
            self.entries[known] = _merged(self.entries[known], mention)
        else:
            name = name_fact(mention.name, "host", mention.place, self.entries, mention.guess)
            known = str(name.value)
            fields = {"address": _address(mention), **mention.fields}
            self.entries[known] = Entry(name, fields, mention.notes)
            self.names |= {one: known for one in (known, name.was) if one and one not in self.names}
        if address := self.entries[known].value("address"):
            self.names.setdefault(str(address), known)
        return known

    def known(self, text: str) -> str:
        """Returns the host with this address or name; empty if there is none."""
        return self.names.get(text) or ("" if is_ip(text) else self.names.get(_short(text), ""))

    def of_file(self, path: str, hub: str) -> Field:
        """Returns the host on which a launch file is started, as far as names show it."""
        folder, file = posixpath.split(path)
        beside = self.folders.get(folder, set())
        if len(self.entries) == 1:
            return Fact(next(iter(self.entries)), None, "it is the only host")
        if len(beside) == 1:
            return Fact(min(beside), None, f"{path} lies beside the ROS variables of this host")
        for part in (file.partition(".")[0], *reversed(folder.split("/"))):
            if part and (host := self.known(part) or self.known(valid_name(part, "host"))):
                return Fact(host, None, f"{path} is called like this host")
        if hub:
            why = "nodes without `machine` start where roslaunch runs, often on the master's host"
            return Fact(hub, None, why)
        return Blank(next(iter(self.entries), "k3-pi"), f"the host on which {path} is started")


def _address(mention: Mention) -> Field:
    if mention.address in OWN:
        return Blank("192.168.77.10", f"{mention.place} has the address of the computer that it is on")
    if not is_allowed("address", mention.address):
        return Blank("192.168.77.10", f"{mention.place} has no usable address")
    return Fact(mention.address, mention.place)


def _merged(entry: Entry, mention: Mention) -> Entry:
    """Adds what is new. An IP address wins over a name, and a name over nothing."""
    fields, notes = {**mention.fields, **entry.fields}, (*entry.notes, *mention.notes)
    old, new = fields.get("address"), _address(mention)
    if isinstance(new, Fact) and (not isinstance(old, Fact) or (is_ip(new.value) and not is_ip(old.value))):
        fields["address"] = new
    elif isinstance(new, Fact) and isinstance(old, Fact) and is_ip(new.value) and new.value != old.value:
        notes = (*notes, f"left out: address {new.value} of {new.place}; check which one is right")
    order = {"address": fields.pop("address"), **fields}
    return replace(entry, fields=order, notes=tuple(dict.fromkeys(notes)))


def _short(name: str) -> str:
    """The first label of a host name: `k3-pi` of `k3-pi.local`."""
    return name.partition(".")[0]
