"""Which host may make which call to a ROS 1 master (wiki.ros.org/ROS/Master_API, ROS/Parameter Server API).

A node has one URI; a registration from another URI replaces the node (rosmaster 1.15, registrations.py).

Pure: a call, its host, the parameters and what is registered in; nothing or the reason for the refusal out.
What somebody owns, nobody else registers, publishes or sets; what nobody owns is free within the island.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Iterator, Mapping, Sequence, Tuple

from swarm_onboard.guard.config import Caller, Config

PUBLISHES, SUBSCRIBES, SERVES, WATCHES = "publishes", "subscribes to", "serves", "watches"
Entry = Tuple[str, str]  # one of these, and a topic, service or parameter


@dataclass
class Node:
    """A node at its URI, registered by ``host``. ``entries`` have the URI for each."""

    uri: str
    host: str
    entries: dict[Entry, str] = field(default_factory=dict)


class Registered:
    """The nodes by name."""

    def __init__(self) -> None:
        self.nodes: dict[str, Node] = {}
        self._counts: Counter[str] = Counter()
        self._publishers: Counter[tuple[str, str]] = Counter()

    def count(self, host: str) -> int:
        """How many registrations ``host`` has."""
        return self._counts[host]

    def publishers(self, host: str, topic: str) -> int:
        """How many nodes of ``host`` publish ``topic``."""
        return self._publishers[host, topic]

    def has(self, name: str, uri: str, entry: Entry) -> bool:
        """Whether the node ``name`` at ``uri`` is registered for that already."""
        node = self.nodes.get(name)
        return node is not None and node.uri == uri and entry in node.entries

    def add(self, name: str, uri: str, host: str, entry: Entry, at: str) -> None:
        """Counts a registration with the URI ``at``; a node of that name at another ``uri`` is forgotten."""
        node = self.nodes.get(name)
        if node is not None and node.uri != uri:
            for one in tuple(node.entries):
                self._drop(name, node, one)
            node = None
        if node is None:
            node = self.nodes[name] = Node(uri, host)
        if entry not in node.entries:
            self._count(node.host, entry, 1)
        node.entries[entry] = at

    def remove(self, name: str, entry: Entry, at: str) -> None:
        """Forgets a registration, if its URI is ``at``. A node that only watches parameters is forgotten: one
        of rospy does not say that it ends to watch them."""
        node = self.nodes.get(name)
        if node is not None and node.entries.get(entry) == at:
            self._drop(name, node, entry)
            if all(kind == WATCHES for kind, _ in node.entries):
                for one in tuple(node.entries):
                    self._drop(name, node, one)

    def _drop(self, name: str, node: Node, entry: Entry) -> None:
        del node.entries[entry]
        self._count(node.host, entry, -1)
        if not node.entries:
            del self.nodes[name]

    def _count(self, host: str, entry: Entry, change: int) -> None:
        kind, what = entry
        self._counts[host] += change
        if kind == PUBLISHES:
            self._publishers[host, what] += change
            if not self._publishers[host, what]:
                del self._publishers[host, what]


MOST_REGISTRATIONS = 2000  # of a host at a time
MOST_PUBLISHERS = 64  # of a topic on a host: rospy opens a thread for each
LONGEST = 512  # characters of a name or a URI

#: What changes nothing, with the number of arguments; the first is the name of the caller.
_READS = {
    **dict.fromkeys(("getUri", "getPid", "getSystemState", "getTopicTypes", "getParamNames"), 1),
    **dict.fromkeys(("getPublishedTopics", "lookupNode", "lookupService"), 2),
    **dict.fromkeys(("getParam", "hasParam", "searchParam"), 2),
}
_SETS = {"setParam": 3, "deleteParam": 2}
#: Of an entry at the master only: every roslaunch sets them anew, to the versions of its own host.
_KEPT = ("/rosdistro", "/rosversion")
_FIXED = ("/run_id", "/use_sim_time", *_KEPT)

_NAME = re.compile(r"(/[A-Za-z0-9_]+)+", re.ASCII)
_URI = re.compile(r"(http|rosrpc)://(\[[0-9a-f:.]+\]|[a-z0-9._-]+):[0-9]{1,5}/?", re.ASCII | re.IGNORECASE)


class RefusedError(Exception):
    """The reason why a call is not passed on, for people."""


@dataclass(frozen=True)
class _Registration:
    """The arguments of a call that registers or unregisters, by their places."""

    kind: str
    adds: bool
    arguments: int
    what: int
    node_uri: int  # 0: the call has none
    at: int


#: registerService(caller, service, service_api, caller_api), unregisterService(caller, service, service_api),
#: registerPublisher(caller, topic, type, caller_api), subscribeParam(caller, caller_api, key), ...
_REGISTERS: Mapping[str, _Registration] = {
    "registerPublisher": _Registration(PUBLISHES, True, 4, 1, 3, 3),
    "unregisterPublisher": _Registration(PUBLISHES, False, 3, 1, 2, 2),
    "registerSubscriber": _Registration(SUBSCRIBES, True, 4, 1, 3, 3),
    "unregisterSubscriber": _Registration(SUBSCRIBES, False, 3, 1, 2, 2),
    "registerService": _Registration(SERVES, True, 4, 1, 3, 2),
    "unregisterService": _Registration(SERVES, False, 3, 1, 0, 2),
    "subscribeParam": _Registration(WATCHES, True, 3, 2, 1, 1),
    "unsubscribeParam": _Registration(WATCHES, False, 3, 2, 1, 1),
}


class Policy:
    """Judges calls by ``config``, and counts the registrations among those that it lets pass."""

    def __init__(self, config: Config) -> None:
        self.config = config
        self._registered = Registered()

    def check(self, caller: Caller, method: str, arguments: Sequence[Any]) -> None:
        """Raises ``RefusedError`` if ``caller`` may not make this call."""
        if method in _READS:
            _expect(_READS[method], arguments, arguments)
        elif method in _REGISTERS:
            self._check_registration(caller, _REGISTERS[method], arguments)
        elif method in _SETS:
            _expect(_SETS[method], arguments, arguments[:2])
            if caller.host != self.config.hub:
                self._check_set(caller, method, arguments)
        else:
            raise RefusedError("no call for others")

    def answer(self, caller: Caller, method: str, arguments: Sequence[Any]) -> list[Any] | None:
        """What the guard itself answers to a call, None if the master does."""
        if method == "getUri" and len(arguments) == 1:
            return [1, "", self.config.uri]
        others = caller.host != self.config.hub and caller.receives is None
        if others and method == "setParam" and len(arguments) == 3 and arguments[1] in _KEPT:
            return [1, f"{arguments[1]} is that of the master", 0]
        return None

    def _check_registration(self, caller: Caller, call: _Registration, arguments: Sequence[Any]) -> None:
        _expect(call.arguments, arguments, arguments)
        node, what, at = (str(arguments[place]) for place in (0, call.what, call.at))
        uri = str(arguments[call.node_uri]) if call.node_uri else ""
        self._check_uri(caller, at, "rosrpc" if call.kind == SERVES else "http")
        if uri:
            self._check_uri(caller, uri, "http")
        if caller.host != self.config.hub:
            _expect_name(node)
            if call.kind != WATCHES:
                _expect_name(what)
            self._check_owner(caller, node)
            self._check_home(caller, node)
            self._check_kind(caller, call, what)
            if call.adds:
                self._check_counts(caller, call.kind, node, uri, what)
        if call.adds:
            self._registered.add(node, uri, caller.host, (call.kind, what), at)
        else:
            self._registered.remove(node, (call.kind, what), at)

    def _check_uri(self, caller: Caller, uri: str, scheme: str) -> None:
        found = _URI.fullmatch(uri)
        if found is None or found.group(1).lower() != scheme:
            raise RefusedError(f"`{uri}` is no URI of a node")
        host = found.group(2).lower().strip("[]")
        if host not in (self.config.named if caller.host == self.config.hub else caller.at):
            raise RefusedError(f"`{uri}` is not on this host")

    def _check_owner(self, caller: Caller, name: str) -> None:
        """Refuses a node, a service or a parameter of somebody else."""
        owners = next((self.config.names[one] for one in _around(name) if one in self.config.names), None)
        if owners is not None and caller.host not in owners:
            raise RefusedError(f"{name} belongs to {_listed(owners)}")

    def _check_home(self, caller: Caller, node: str) -> None:
        """Refuses the name of a node that runs elsewhere: the master would shut that one down."""
        known = self._registered.nodes.get(node)
        owned = any(one in self.config.names for one in _around(node))
        if known is not None and not owned and known.host != caller.host:
            raise RefusedError(f"a node of that name runs on {known.host}")

    def _check_kind(self, caller: Caller, call: _Registration, what: str) -> None:
        if caller.receives is not None and call.adds and call.kind != PUBLISHES:
            if call.kind != SUBSCRIBES:
                raise RefusedError("hosts of other islands only subscribe and publish")
            if what not in caller.receives:
                raise RefusedError(f"nothing brings {what} to its island")
        elif caller.receives is not None and call.adds and what not in caller.sends:
            raise RefusedError(f"nothing brings {what} from its island")
        elif call.kind == PUBLISHES and call.adds:
            owners = self.config.topics.get(what)
            if owners is not None and caller.host not in owners:
                raise RefusedError(f"{_listed(owners)} may publish {what}")
        elif call.kind == SERVES:
            self._check_owner(caller, what)

    def _check_counts(self, caller: Caller, kind: str, node: str, uri: str, what: str) -> None:
        if self._registered.has(node, uri, (kind, what)):
            return
        if self._registered.count(caller.host) >= MOST_REGISTRATIONS:
            raise RefusedError(f"this host has {MOST_REGISTRATIONS} registrations")
        if kind == PUBLISHES and self._registered.publishers(caller.host, what) >= MOST_PUBLISHERS:
            raise RefusedError(f"{MOST_PUBLISHERS} nodes of this host publish {what}")

    def _check_set(self, caller: Caller, method: str, arguments: Sequence[Any]) -> None:
        """Refuses a parameter of somebody else, alone or as part of what is set."""
        if caller.receives is not None:
            raise RefusedError("hosts of other islands set no parameters")
        given = arguments[1]
        if not given.startswith("/"):
            raise RefusedError(f"`{given}` is no global name")
        key = "/" + "/".join(part for part in given.split("/") if part)
        if (method, key) == ("setParam", "/use_sim_time") and arguments[2] is self.config.use_sim_time:
            return
        for fixed in _FIXED:
            if fixed == key or fixed in _around(key) or key == "/":
                raise RefusedError(f"{fixed} is set by the master's host")
        self._check_owner(caller, key)
        below = key.rstrip("/") + "/"
        for name, owners in self.config.names.items():
            if name.startswith(below) and caller.host not in owners:
                raise RefusedError(f"{name} in it belongs to {_listed(owners)}")


def _around(name: str) -> Iterator[str]:
    """Yields ``name`` and the namespaces that it lies in, the longest first."""
    while name:
        yield name
        name = name.rpartition("/")[0]


def _listed(owners: frozenset[str]) -> str:
    return ", ".join(sorted(owners)) or "no host of this island"


def _expect(count: int, arguments: Sequence[Any], names: Sequence[Any]) -> None:
    """Refuses another number of arguments, and ``names`` that are no text or too long."""
    if len(arguments) != count or not all(isinstance(one, str) and len(one) <= LONGEST for one in names):
        raise RefusedError("invalid arguments")


def _expect_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise RefusedError(f"`{name}` is no global name")
