"""The hosts of a lab as its files mention them, and what follows: masters, mode and networks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.lab_folder import ROS_PORT, master_of
from swarmctl.ros_packages.launch_files import Place
from swarmctl.spec.model import Mode
from swarmctl.swarm.addresses import ip_of, means_self, usual_subnet
from swarmctl.swarm.modes import MULTIMASTER, ROLES

EXAMPLE = "192.168.77.11"
LARGEST_DOMAIN = 101  # the largest ROS_DOMAIN_ID of a spec


class LabHosts:
    """Adds hosts to a draft. A host is known by its address or by one of its names."""

    def __init__(self, draft: Draft) -> None:
        self.draft = draft
        self._known: dict[str, str] = {}  # hosts by their names and addresses
        for key, host in draft.hosts.items():
            self._learn(key, host.name.was or key, host.fields["address"])

    def new(self, name: str, place: Place | None, fields: Mapping[str, Value], guess: str = "") -> str:
        """Adds a host; returns its name in the spec. ``fields`` have its address."""
        hosts, address = self.draft.hosts, fields["address"]
        key = str(named(_short(name), "host", place, hosts).value)
        was = name if key != name and not guess else ""
        hosts[key] = Entry(Value(key, place, guess, was), dict(fields))
        self._learn(key, name, address)
        return key

    def _learn(self, key: str, name: str, address: Value) -> None:
        for one in (key, name, _short(name), *([] if address.fill_in else [str(address.value)])):
            self._known.setdefault(one, key)

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


def add_islands(draft: Draft, domains: Mapping[int, Sequence[str]], written: Mapping[int, Value]) -> None:
    """Adds an island for the hosts of each domain of ROS 2, in the order of their numbers.

    ``written`` has where each domain stands, or the guess that it is derived by.
    """
    ordered = sorted(domains)
    place = written[ordered[0]].place
    guesses = dict.fromkeys(one.guess for one in written.values() if one.guess)
    draft.first.pop("hub", None)
    draft.first["mode"] = Value("combined", place, f"hosts have {len(domains)} domains")
    islands = {
        f"domain-{one}": {"mode": "central", "hub": domains[one][0], "hosts": [*domains[one]]}
        for one in ordered
    }
    why = "; ".join(("the hosts of a domain are an island", *guesses))
    draft.last["islands"] = Value(islands, place, why)
    for there, one in enumerate(ordered, ordered[0]):
        if one != there:
            here = f"a spec numbers the islands on from the first one, so it is {there} there"
            draft.unread.append(f"{written[one].place}: the domain {one}; {here}")
    for key, host in draft.hosts.items():
        if not any(key in members for members in domains.values()):
            draft.unread.append(f"{host.name.place}: host `{key}` has no domain, and is in no island")


def number(text: str) -> int | str:
    """Returns a port as a number, or the text if it is none."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 10 else text


def domain_of(text: str) -> int | None:
    """Returns a ROS_DOMAIN_ID; None for a text that is none which a spec can have."""
    found = number(text)
    return found if isinstance(found, int) and found <= LARGEST_DOMAIN else None


def _short(name: str) -> str:
    """The first label of a host name: `k3-pi` of `k3-pi.local`; an IP address is whole."""
    return name if ip_of(name) else name.partition(".")[0]


def arrange(draft: Draft) -> None:
    """Adds the mode, the networks and the adapters of hosts to a draft that has all else."""
    draft.first = draft.first or dict(_mode(draft))
    mode = Mode(draft.first["mode"].value)
    if mode not in MULTIMASTER and draft.multimaster:
        place = draft.multimaster["packages"].place
        draft.unread.append(f"{place}: fkie's multimaster has no use with one master")
        draft.multimaster.clear()
    if mode is Mode.COMBINED:
        why = "hosts with the same ROS_MASTER_URI are an island"
        draft.last = {"islands": Value(_islands(_by_master(draft)), guess=why), **draft.last}
    addresses = {name: host.fields["address"] for name, host in draft.hosts.items()}
    draft.networks += _networks(
        {name: "" if one.fill_in else str(one.value) for name, one in addresses.items()}
    )
    for line in draft.lines:
        if line.value["kind"] == "bluetooth" and not line.fill_in:
            adapter = Value(["hci0"], guess="its first Bluetooth adapter")
            draft.hosts[line.value["host"]].fields["bluetooth"] = adapter


def _by_master(draft: Draft) -> Mapping[str, Sequence[str]]:
    """The hosts that use each master, by the master's host."""
    groups: dict[str, list[str]] = {}
    for host in draft.hosts:
        if host in draft.masters:
            groups.setdefault(draft.masters[host].value, []).append(host)
    return groups


def _mode(draft: Draft) -> Mapping[str, Value]:
    groups, multimaster = _by_master(draft), bool(draft.multimaster)
    known = [draft.masters[host] for host in draft.hosts if host in draft.masters]
    wrong = next((one for one in known if one.needed), Value(""))
    if len(draft.hosts) == 1 and not multimaster:
        only = replace(wrong, value=next(iter(draft.hosts)), guess="it is the only host")
        return {"mode": Value(Mode.SINGLE_MINDED.value, guess="there is one host"), "leader": only}
    if len(groups) == 1 and (len(known) > 1 or known[0].value not in next(iter(groups.values()))):
        return _one_master(draft, wrong if wrong.needed else known[0])
    first = wrong if wrong.needed or not known else replace(known[0], fill_in="")
    if len(known) == len(draft.hosts) and any(len(one) > 1 for one in groups.values()):
        why = f"there are {len(groups)} masters, and some hosts share one"
        return {"mode": replace(first, value=Mode.COMBINED.value, guess=why)}
    if groups and multimaster:
        why = "each host has its own master, and fkie's multimaster joins them"
    elif groups:
        why = "the hosts with a ROS_MASTER_URI do not share a master"
    elif multimaster:
        why = "nodes of fkie's multimaster join several masters"
    else:
        why = "no ROS_MASTER_URI was found, and without one ROS looks for the master on each node's own host"
    return {"mode": replace(first, value=Mode.STANDALONE.value, guess=why)}


def _one_master(draft: Draft, hub: Value) -> Mapping[str, Value]:
    programs = [one.fields for one in draft.programs.values() if not one.name.fill_in]
    hosts = [one["host"] for one in programs if "host" in one]
    busy = {one.value for one in hosts if not one.fill_in}
    why = hub.guess or f"ROS_MASTER_URI names `{hub.value}`"
    mode, because = Mode.CENTRAL, f"{why}; `leader` if only this host commands robots"
    if busy == {hub.value}:
        mode, because = Mode.LEADER, f"{why}, and programs run there only"
    elif busy:
        because = f"{why}, and programs run on other hosts too"
    return {"mode": Value(mode.value, hub.place, because), ROLES[mode].key: hub}


def _islands(groups: Mapping[str, Sequence[str]]) -> Mapping[str, object]:
    return {
        hub: {"mode": Mode.CENTRAL.value, "hub": hub, "hosts": list(dict.fromkeys([hub, *members]))}
        for hub, members in groups.items()
    }


def _networks(addresses: Mapping[str, str]) -> Iterator[Value]:
    """A network for the hosts of each /24; a host whose address is a name joins the largest."""
    subnets = {host: _subnet(address) for host, address in addresses.items()}
    sizes = Counter(one for one in subnets.values() if one)
    largest = sizes.most_common(1)[0][0] if sizes else ""
    groups: dict[str, list[str]] = {}
    for host, subnet in subnets.items():
        groups.setdefault(subnet or largest, []).append(host)
    shared = {subnet: members for subnet, members in groups.items() if len(members) > 1}
    for count, (subnet, members) in enumerate(shared.items(), 1):
        value = {"kind": "wlan", "name": "lab" if count == 1 else f"lab-{count}", "hosts": members}
        whose = (
            "their addresses are"
            if all(subnets[one] for one in members)
            else "those addresses that are not names are"
        )
        why = f"{whose} in {subnet}" if subnet else "nothing names their network"
        yield Value(value, guess=f"{why}; `wlan` or `ethernet`")
    if not shared and len(addresses) > 1:
        value = {"kind": "wlan", "name": "lab", "hosts": list(addresses)}
        yield Value(value, fill_in="the addresses share no network; write which hosts reach each other")


def _subnet(address: str) -> str:
    ip = ip_of(address)
    return str(usual_subnet(ip)) if ip else ""
