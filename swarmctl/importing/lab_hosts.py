"""The hosts of a lab as its files mention them, and the masters that they use."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.ros_variables import ROS_PORT, master_of
from swarmctl.ros_packages.launched import Place
from swarmctl.swarm.addresses import ip_of, means_self

EXAMPLE = "192.168.77.11"


class LabHosts:
    """Adds hosts to a draft. A host is known by its address or by one of its names."""

    def __init__(self, draft: Draft) -> None:
        self.draft = draft
        self._known: dict[str, str] = {}  # hosts by their names and addresses

    def new(self, name: str, place: Place | None, fields: Mapping[str, Value], guess: str = "") -> str:
        """Adds a host; returns its name in the spec. ``fields`` have its address."""
        hosts, address = self.draft.hosts, fields["address"]
        key = str(named(_short(name), "host", place, hosts).value)
        was = name if key != name and not guess else ""
        hosts[key] = Entry(Value(key, place, guess, was), dict(fields))
        for one in (key, name, _short(name), *([] if address.fill_in else [str(address.value)])):
            self._known.setdefault(one, key)
        return key

    def add(self, name: str, place: Place | None, fields: Mapping[str, Value], guess: str = "") -> str:
        """Adds a host, or what is new about one that is known; returns its name in the spec."""
        address = fields["address"]
        key = "" if address.fill_in else self.find(str(address.value))
        if not key:
            key = self.find(name)
            if key and guess and self.draft.hosts[key].name.guess:
                key = ""  # two scripts of one name are for two hosts
        if not key:
            return self.new(name, place, fields, guess)
        known = self.draft.hosts[key].fields
        old, known["address"] = known["address"], self._better(known["address"], address)
        for one, value in fields.items():
            known.setdefault(one, value)
        if old != known["address"]:
            self._known.setdefault(str(address.value), key)
        return key

    def _better(self, old: Value, new: Value) -> Value:
        """The address to keep: an IP address wins over a name, and a name over nothing."""
        if old.fill_in and new.fill_in and old != new:
            return replace(old, fill_in=f"{old.fill_in}; {new.fill_in}")
        if old.fill_in or (ip_of(str(old.value)) is None and ip_of(str(new.value)) and not new.fill_in):
            return new
        if new.needed and new.value == old.value:
            return new
        if (ip_of(str(new.value)) or new.needed) and new.value != old.value and not new.fill_in:
            self.draft.unread.append(f"{new.place}: the address {new.value}; {old.place} has {old.value}")
        return old

    def find(self, text: str) -> str:
        """Returns the host with this address or name; empty if there is none."""
        return self._known.get(text) or self._known.get(_short(text), "")

    def add_master(self, users: Collection[str], uri: Value) -> None:
        """Adds the master that hosts use, and the master's own host if it is not known yet."""
        master, port = master_of(uri)
        address = str(master.value)
        if not address:
            self.draft.unread.append(f"{uri.place}: ROS_MASTER_URI names no host")
            return
        hub = ""
        if not means_self(address):
            name = "master" if ip_of(address) else address
            hub = self.find(address) or self.new(name, uri.place, {"address": Value(address, uri.place)})
        for user in (*users, hub) if hub else users:
            found = replace(master, value=hub or user)
            old = self.draft.masters.setdefault(user, found)
            if found.needed and old.value == found.value:
                self.draft.masters[user] = found
            if port != ROS_PORT:
                self.draft.hosts[hub or user].fields["master_port"] = Value(port, uri.place)


def address_of(text: str, place: Place) -> Value:
    """Returns the address of a host, to fill in if it is what each computer calls itself."""
    if means_self(text):
        return Value(EXAMPLE, fill_in=f"{place} has the address of the computer that it is on")
    return Value(text, place)


def number(text: str) -> int | str:
    """Returns a port as a number, or the text if it is none."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 10 else text


def _short(name: str) -> str:
    """The first label of a host name: `k3-pi` of `k3-pi.local`; an IP address is whole."""
    return name if ip_of(name) else name.partition(".")[0]
