"""The mode, the islands and the key `ros` of a draft, from the robot.yaml of each robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import yaml

from swarmctl.importing.draft import Draft, Value
from swarmctl.importing.lab_hosts import LARGEST_DOMAIN, LabHosts, add_islands, number
from swarmctl.importing.ros2_lab import RMW
from swarmctl.importing.yaml_values import YamlValues, child_of, is_empty, quoted
from swarmctl.yamltext.compose import pairs_of

_HUMBLE, _JAZZY = "humble", "jazzy"
_METHODS = {"simple": "multicast", "server": "server"}
_PORT = "11811"
_YES, _NO = ("true", "yes", "on"), ("false", "no", "off")
_ALL_SERVE = "a file without `servers` has one on each of its hosts"
_NO_DOMAIN = "a robot.yaml without domain_id has the domain 0"

Islands = Mapping[str, int]
"""The domain of the island of each host; empty if there is one domain."""


@dataclass
class ClearpathFile:
    """A robot.yaml with the hosts of the draft that it names, also by their names and addresses there."""

    values: YamlValues
    system: yaml.Node | None
    hosts: list[Value] = field(default_factory=list)
    names: dict[str, str] = field(default_factory=dict)

    @property
    def ros(self) -> yaml.Node | None:
        """What it has about ROS 2."""
        return child_of(self.system, "ros2")

    @property
    def middleware(self) -> yaml.Node | None:
        """How its nodes find each other."""
        return child_of(self.ros, "middleware")


@dataclass(frozen=True)
class _Server:
    """A discovery server of a file, on a host of the draft, with its number if the file has one."""

    host: str
    name: Value
    number: Value | None


def add_ros(draft: Draft, hosts: LabHosts, files: Sequence[ClearpathFile]) -> None:
    """Adds the mode, the islands and the key `ros`: the first file that has a value decides."""
    if not files:
        return
    distro = _distro(draft, files)
    domains = _domains(draft, files)
    draft.first = {
        "mode": Value("central", guess="nodes of ROS 2 share a graph, and each robot has its own mind"),
        "hub": replace(files[0].hosts[0], guess="it is the first host"),
    }
    islands = _islands(draft, files, domains)
    kept = [one for one in domains.values() if not islands or one.value in islands.values()]
    found = {
        "domain": min(kept, key=lambda one: int(one.value), default=None),
        "rmw": _first(draft, files, "implementation", RMW),
        "discovery": _first(draft, files, "discovery", _METHODS),
    }
    ros = {"distro": distro.value, **{key: one.value for key, one in found.items() if one}}
    is_served = ros.get("discovery") == "server"
    servers = _servers(draft, hosts, files, domains, islands) if is_served else []
    if servers:
        ros["servers"] = [one.host for one in servers]
    values = [one for one in (*found.values(), *(one.name for one in servers)) if one]
    reasons = [distro.guess]
    if places := dict.fromkeys(str(one.place) for one in values if not one.guess):
        reasons.append(f"what follows is from {', '.join(places)}")
    reasons += dict.fromkeys(one.guess for one in values if one.guess)
    draft.first["ros"] = replace(distro, value=ros, guess="; ".join(reasons))


def _distro(draft: Draft, files: Sequence[ClearpathFile]) -> Value:
    """The distribution, by the form in which files have their hosts; that of the first file."""
    found: list[Value] = []
    for file in files:
        at, group = pairs_of(file.system)["hosts"]
        name = _JAZZY if isinstance(group, yaml.SequenceNode) else _HUMBLE
        why = f"its hosts are written as files of {name.title()} have them"
        found.append(Value(name, file.values.place(at), why))
    first = found[0]
    for one in found:
        if one.value != first.value:
            draft.unread.append(f"{one.place}: {one.guess}; the draft has {first.value}, as {first.place}")
    return first


def _first(draft: Draft, files: Sequence[ClearpathFile], key: str, words: Mapping[str, str]) -> Value | None:
    """The first value of the files at a key of `middleware` that has a word in a spec."""
    found: Value | None = None
    for file in files:
        one = file.values.take(file.middleware, key)
        if one is None:
            continue
        word = words.get(str(one.value))
        if word is None:
            draft.unread.append(f"{one.place}: {key}: a spec has no word for {quoted(str(one.value))}")
        elif found is None:
            found = replace(one, value=word)
        elif found.value != word:
            has = f"{found.place} has another one, which is `{found.value}` in a spec, and a swarm has one"
            draft.unread.append(f"{one.place}: {key} {one.value}; {has}")
    return found


def _domains(draft: Draft, files: Sequence[ClearpathFile]) -> Mapping[str, Value]:
    """The domain of each file by its path. A file without `domain_id` has 0, if others have one."""
    found: dict[str, Value] = {}
    usual: dict[str, Value] = {}
    for file in files:
        domain = file.values.take(file.ros, "domain_id") or file.values.take(file.system, "domain_id")
        if domain is None:
            usual[file.values.path] = Value(0, file.hosts[0].place, _NO_DOMAIN)
            continue
        value = number(str(domain.value))
        if isinstance(value, int) and value <= LARGEST_DOMAIN:
            found[file.values.path] = replace(domain, value=value)
        else:
            draft.unread.append(f"{domain.place}: domain_id is none from 0 to {LARGEST_DOMAIN}")
    return {**found, **usual} if found else {}


def _islands(draft: Draft, files: Sequence[ClearpathFile], domains: Mapping[str, Value]) -> Islands:
    """Adds an island for each domain, if there are several. A host of several files is in the first's."""
    if len({one.value for one in domains.values()}) < 2:
        return {}
    islands: dict[str, int] = {}
    places: dict[int, Value] = {}
    members: dict[int, list[str]] = {}
    for file in files:
        domain = domains.get(file.values.path)
        if domain is None:
            continue
        for host in file.hosts:
            if host.value not in islands:
                islands[host.value] = domain.value
                members.setdefault(domain.value, []).append(host.value)
                places.setdefault(domain.value, domain)
            elif (other := islands[host.value]) != domain.value:
                why = f"it is in the island of domain {other}, and a host is in one"
                draft.unread.append(f"{host.place}: host `{host.value}` in domain {domain.value}; {why}")
        if domain.value not in members:
            draft.unread.append(f"{domain.place}: domain_id {domain.value}: no host is left for its island")
    if len(members) > 1:
        add_islands(draft, members, places)
    return islands


def _servers(
    draft: Draft,
    hosts: LabHosts,
    files: Sequence[ClearpathFile],
    domains: Mapping[str, Value],
    islands: Islands,
) -> Sequence[_Server]:
    """The discovery servers, each once, file by file; lists those with another number than in a spec."""
    found: dict[str, _Server] = {}
    numbered: list[_Server] = []
    for file in files:
        method = file.values.take(file.middleware, "discovery")
        if method is None or method.value != "server":
            continue
        domain = domains.get(file.values.path)
        for one in _servers_of(draft, hosts, file):
            if islands and islands.get(one.host) != (domain.value if domain else None):
                why = "it is in another island than the hosts of this file, whose hub has a server then"
                draft.unread.append(f"{one.name.place}: server {quoted(str(one.name.value))}: {why}")
            else:
                found.setdefault(one.host, one)
            numbered.append(one)
    for one in numbered:
        island = [host for host in found if islands.get(host) == islands.get(one.host)]
        place = island.index(one.host) if one.host in found else None
        if one.number and one.number.value != place:
            why = f"has the number {place} in a spec, its place in `servers`"
            why = f"`{one.host}` {'is not in `servers`' if place is None else why}"
            draft.unread.append(f"{one.number.place}: server_id {one.number.value}: {why}")
    return list(found.values())


def _servers_of(draft: Draft, hosts: LabHosts, file: ClearpathFile) -> Sequence[_Server]:
    """The servers of a file in the order of their numbers; without `servers`, all its hosts."""
    written = child_of(file.middleware, "servers")
    if written is None or is_empty(written):
        return [_Server(one.value, replace(one, guess=_ALL_SERVE), None) for one in file.hosts]
    found: dict[str, _Server] = {}
    for item in written.value if isinstance(written, yaml.SequenceNode) else ():
        if (one := _server(draft, hosts, file, item)) is None:
            continue
        if (old := found.setdefault(one.host, one)) is not one:
            why = f"its host has one at {old.name.place}, and a host runs one"
            draft.unread.append(f"{one.name.place}: server {quoted(str(one.name.value))}: {why}")
    return sorted(found.values(), key=lambda one: (one.number.value if one.number else 0, one.host))


def _server(draft: Draft, hosts: LabHosts, file: ClearpathFile, item: yaml.Node) -> _Server | None:
    """A server of a file; one that no host of the draft runs is listed."""
    values = file.values
    name = values.take(item, "hostname") or values.take(item, "ip")
    if name is None:
        return None
    text = str(name.value)
    host = file.names.get(text) or hosts.find(text)
    enabled = values.find(item, "enabled")
    if not host or _is(enabled, _NO):
        why = "it is not enabled" if host else "no host of these files has this name or address"
        draft.unread.append(f"{name.place}: server {quoted(text)}: {why}")
        return None
    if _is(enabled, _YES):
        values.take(item, "enabled")
    address = values.find(item, "ip")
    if address and address.value == draft.hosts[host].fields["address"].value:
        values.take(item, "ip")
    if (port := values.take(item, "port")) and port.value != _PORT:
        draft.unread.append(f"{port.place}: port {quoted(str(port.value))}; swarmctl takes {_PORT}")
    place = values.find(item, "server_id")
    if place is None or not isinstance(number(str(place.value)), int):
        return _Server(host, name, None)
    values.take(item, "server_id")
    return _Server(host, name, replace(place, value=number(str(place.value))))


def _is(value: Value | None, words: Sequence[str]) -> bool:
    return value is not None and str(value.value).lower() in words
