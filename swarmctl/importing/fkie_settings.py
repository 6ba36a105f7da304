"""The settings of fkie's discovery and sync nodes, as far as a spec has a key for them."""

from __future__ import annotations

import re
import shlex
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import yaml

from swarmctl.importing.draft import Draft, Value
from swarmctl.importing.lab_hosts import LabHosts
from swarmctl.ros_packages.launch_files import Launched, Node, Place, Rosparam
from swarmctl.ros_packages.launch_files import Setting as Parameter
from swarmctl.swarm.addresses import ip_of, means_self
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.files import LoadBudget

_KEYS = {"mcast_group": "group", "mcast_port": "port"}
_SAME = ("heartbeat_hz", "active_request_after", "remove_after")  # called alike in a spec
_MASTERS = ("sync_hosts", "ignore_hosts")
_REMAP = re.compile(r"_(\w+):=(.*)", re.DOTALL)
_NAME = re.compile(r"/?[A-Za-z]\w*(/\w+)*", re.ASCII)
Setting = tuple[str, Any, Place]


class FkieSettings:
    """Adds the settings of fkie's nodes to a draft."""

    def __init__(self, draft: Draft, hosts: LabHosts) -> None:
        self.draft = draft
        self.hosts = hosts

    def add_hosts(self, node: Node, whole: Launched) -> None:
        """Adds the hosts that a node has as peers."""
        for name, value, place in _settings(node, whole):
            for address in _texts(value) if name == "robot_hosts" else ():
                if not self.hosts.find(address) and not means_self(address):
                    called = "master" if ip_of(address) else address
                    self.hosts.new(called, place, {"address": Value(address, place)})

    def add(self, node: Node, whole: Launched, packages: str, host: str) -> None:
        """Adds the settings of a node of ``whole`` that runs on ``host``; empty for every master."""
        self._set("packages", packages, node.place)
        for name, value, place in _settings(node, whole):
            if value is None:
                self.draft.unread.append(f"{place}: {name} cannot be read")
            elif name in _KEYS or name in _SAME:
                self._set(
                    _KEYS.get(name, name), value if isinstance(value, int | float) else str(value), place
                )
            elif name == "robot_hosts":
                if found := self._known(name, value, place):
                    self._add_peers(found, place, self._receivers(host))
            elif name in _MASTERS:
                if found := self._known(name, value, place):
                    self._set(name, found, place)
            elif name == "sync_topics":
                self._add_topics(value, place, host)
            else:
                self.draft.unread.append(f"{place}: a spec has no key for {name}")

    def _set(self, key: str, value: Any, place: Place) -> None:
        old = self.draft.multimaster.setdefault(key, Value(value, place))
        if old.value != value:
            self.draft.unread.append(f"{place}: {key}; {old.place} has another value")

    def _known(self, name: str, value: Any, place: Place) -> list[str]:
        """The hosts in a list of their names or addresses."""
        texts = _texts(value)
        unknown = [one for one in texts if not self.hosts.find(one) and not means_self(one)]
        self.draft.unread += [f"{place}: {name}: no host is called {one}" for one in unknown]
        return list(dict.fromkeys(found for one in texts if (found := self.hosts.find(one))))

    def _receivers(self, host: str) -> Sequence[str]:
        masters = self.draft.masters
        return (
            [host]
            if host
            else [one for one in self.draft.hosts if one not in masters or masters[one].value == one]
        )

    def _add_peers(self, peers: Collection[str], place: Place, hubs: Collection[str]) -> None:
        old = self.draft.multimaster.setdefault("robot_hosts", Value({}, place)).value
        for hub in hubs:
            old[hub] = list(dict.fromkeys([*old.get(hub, ()), *(one for one in peers if one != hub)]))

    def _add_topics(self, value: Any, place: Place, host: str) -> None:
        receivers = self._receivers(host)
        guess = "" if host else "each master receives them"
        for origin, topic in _topics(value):
            own = self.hosts.find(origin)
            to = [one for one in receivers if one != own]
            one, found = {"topic": topic, "to": to}, Value([], place, guess)
            if _NAME.fullmatch(topic):
                found = self.draft.multimaster.setdefault("topics", found)
            else:
                why = f"{place}: sync_topics has a pattern; write each topic"
                found = self.draft.patterns.setdefault("topics", Value([], fill_in=why))
            _merge(found.value, one)


def _merge(topics: list[dict[str, Any]], new: dict[str, Any]) -> None:
    for one in topics:
        if one["topic"] == new["topic"]:
            one["to"] = list(dict.fromkeys([*one["to"], *new["to"]]))
            return
    topics.append(new)


def _topics(value: Any) -> Iterator[tuple[str, str]]:
    """The topics of `sync_topics`, each with the master that it is from, if that is given."""
    for one in value if isinstance(value, list) else [value]:
        if isinstance(one, dict):
            yield from ((str(host), topic) for host, topics in one.items() for topic in _texts(topics))
        else:
            yield from (("", topic) for topic in _texts(one))


def _texts(value: Any) -> list[str]:
    items = value if isinstance(value, list) else [value]
    return [str(one) for one in items if isinstance(one, str | int | float) and str(one)]


def _settings(node: Node, whole: Launched) -> Iterator[Setting]:
    """The private parameters of a node, however they are set; None for a value that cannot be read."""
    for name, value, place in _named(node.parameters, node.rosparams):
        yield name or "its rosparam", value, place
    for word in _words(node.arguments or ""):
        if match := _REMAP.fullmatch(word):
            yield match[1], _data(match[2]), node.place
    called = (node.name or "").strip("/")
    for name, value, place in _named(whole.parameters, whole.rosparams):
        if name == called and isinstance(value, dict):
            yield from ((_plain(str(one)), data, place) for one, data in value.items())
        elif name.startswith(f"{called}/"):
            yield name.removeprefix(f"{called}/"), value, place


def _named(parameters: Sequence[Parameter], rosparams: Sequence[Rosparam]) -> Iterator[Setting]:
    """Parameters with their values; one without a name is a text that cannot be read."""
    for one in parameters:
        yield _plain(one.name), _data(one.value), one.place
    for text in rosparams:
        data = _data(text.text)
        if text.name or not isinstance(data, dict):
            yield _plain(text.name or ""), data, text.place
        else:
            yield from ((_plain(str(name)), value, text.place) for name, value in data.items())


def _words(arguments: str) -> Sequence[str]:
    try:
        return shlex.split(arguments)
    except ValueError:
        return ()


def _plain(name: str) -> str:
    """The name of a private parameter without what marks it as private."""
    return name.lstrip("~_/")


def _data(text: str | None) -> Any:
    """The value of a text in YAML; None if it cannot be read."""
    if text is None or compose(text, "", LoadBudget())[1] is not None:
        return None
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError):
        return None
