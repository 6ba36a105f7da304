"""Reads the services of a Docker Compose file, each as a container and as what it sets and starts.

Source: the Compose Specification, github.com/compose-spec/compose-spec: services, merges, interpolation.
"""

from __future__ import annotations

import posixpath
import re
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import yaml

from swarmctl.importing.draft import Value
from swarmctl.importing.lab_folder import LabFolder
from swarmctl.importing.lab_scripts import OF_ROS_1, OF_ROS_2
from swarmctl.importing.shell_script import Assignment, read_script
from swarmctl.importing.unknown_values import is_secret
from swarmctl.robot_types.ros_launchable import escaped
from swarmctl.ros_packages.launch_files import Place, Setting
from swarmctl.yamltext.compose import compose, is_null, pairs_of
from swarmctl.yamltext.files import LoadBudget

_VARIABLE = re.compile(r"\$(?:(\$)|(\w+)|\{(\w+)(?:(:?[-?+])([^{}]*))?\})")
_OF_ROS_1 = re.compile(r"\broslaunch\b|\brosrun\b|\broscore\b|ROS_MASTER_URI|\b(noetic|melodic|kinetic)\b")
_SAME = {"network_mode": "host", "net": "host"}  # what a container of a spec has anyway
_TOP = {"version", "name", "services"}
_DEPTH = 8  # of merges


@dataclass
class Service:
    """One service. ``unread`` has what of it has no key in a spec."""

    name: str
    place: Place
    image: str = ""
    command: list[str] = field(default_factory=list)
    devices: list[str] = field(default_factory=list)
    volumes: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)  # of the folder, by their names in the container
    is_privileged: bool = False
    environment: dict[str, Setting] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)
    of_swarm: Mapping[str, Value] = field(default_factory=dict)  # variables that all services share

    @property
    def container(self) -> Mapping[str, Any]:
        """The key `container` of its program, whose image a spec has by its digest."""
        values = {
            "command": [*map(self._with_files, self.command)],
            "devices": self.devices,
            "volumes": self.volumes,
        }
        pinned = f"{self.image or self.name}@sha256:..."
        privileged = {"privileged": True} if self.is_privileged else {}
        return {"image": pinned, **{key: one for key, one in values.items() if one}, **privileged}

    def _with_files(self, word: str) -> str:
        """A word in which the files that a spec delivers have their paths there."""
        word = escaped(word)
        for there, path in self.files.items():
            word = word.replace(there, f"{{files}}/{posixpath.basename(path)}")
        return word

    @property
    def variables(self) -> Mapping[str, Value]:
        """The variables that say which nodes find each other."""
        return {
            name: Value(one.value, one.place)
            for name, one in self.environment.items()
            if name in (*OF_ROS_1, *OF_ROS_2) and one.value
        }


def is_compose(root: yaml.Node | None) -> bool:
    """Returns True if the top of a YAML file is that of a Compose file."""
    services = pairs_of(pairs_of(root).get("services", (None, None))[1]).values()
    keys = {"image", "build", "command", "extends", "<<"}
    return bool(services) and all(keys & pairs_of(one).keys() for _, one in services)


def is_compose_of_ros_1(text: str) -> bool:
    """Returns True for a Compose file whose containers run ROS 1."""
    return bool(_OF_ROS_1.search(text))


def services_of(folder: LabFolder, path: str) -> tuple[list[Service], list[str]]:
    """Returns the services of a Compose file in a folder, and what else it has."""
    root, _ = compose(folder.texts[path], path, LoadBudget())
    reader = _Reader(folder, path)
    services = pairs_of(pairs_of(root).get("services", (None, None))[1])
    found = [reader.service(name, key, one) for name, (key, one) in reversed(services.items())]
    others = [
        f"{reader.place(key)}: a spec has no key for the {name} of a Compose file"
        for name, (key, _) in reversed(pairs_of(root).items())
        if name not in _TOP and not name.startswith("x-")
    ]
    return found, others


class _Reader:
    """Reads one file."""

    def __init__(self, folder: LabFolder, path: str) -> None:
        self.folder, self.path = folder, path
        self.defaults: dict[str, None] = {}
        self.known = self.file(".env")

    def place(self, node: yaml.Node) -> Place:
        return Place(self.path, node.start_mark.line + 1)

    def file(self, name: str) -> Mapping[str, Setting]:
        """The variables of a file beside this one."""
        path = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), name))
        if path not in self.folder.texts:
            return {}
        steps = read_script(path, {path: self.folder.texts[path]}).steps
        return {
            one.name: Setting(one.name, one.value if isinstance(one.value, str) else None, one.place)
            for one in steps
            if isinstance(one, Assignment)
        }

    def service(self, name: str, key: yaml.Node, node: yaml.Node) -> Service:
        service = Service(name, self.place(key))
        pairs = _merged(node)
        for one, (at, value) in pairs.items():
            if one == "env_file":
                for file in self.texts(value, service):
                    self.add_file(file, self.place(at), service)
        for one, (at, value) in pairs.items():
            self.key(service, one, at, value)
        for there, path in list(service.files.items()):
            if not any(there in word for word in service.command):
                del service.files[there]
                why = f"the file {path} is at {there} in `{name}`, which only its image knows"
                service.unread.append(f"{service.place}: {why}")
        return service

    def key(self, service: Service, name: str, at: yaml.Node, value: yaml.Node) -> None:
        """Adds one key of a service."""
        if name == "image":
            service.image = next(iter(self.texts(value, service)), "")
        elif name in ("command", "entrypoint"):
            words = self.words(value, service)
            service.command = (
                [*words, *service.command] if name == "entrypoint" else [*service.command, *words]
            )
        elif name == "devices":
            for one in self.texts(value, service):
                here, *there = re.split(":(?=[/rwm])", one)
                service.devices.append(here)
                if there and there[0] != here:
                    service.unread.append(
                        f"{self.place(at)}: the device {here} is {there[0]} in the container"
                    )
        elif name == "volumes":
            self.volumes(service, at, value)
        elif name == "privileged":
            service.is_privileged = next(iter(self.texts(value, service)), "") == "true"
        elif name == "environment":
            self.environment(service, value)
        elif name == "container_name" and isinstance(value, yaml.ScalarNode):
            if value.value != service.name:
                service.unread.append(f"{self.place(at)}: `{value.value}`: its program is `{service.name}`")
        elif name not in ("env_file", "restart", "tty", "stdin_open") and not (
            isinstance(value, yaml.ScalarNode) and _SAME.get(name) == value.value
        ):
            shown = f" ({value.value})" if isinstance(value, yaml.ScalarNode) else ""
            shown = "" if is_secret(name, shown) else shown
            why = f"{name}{shown} of the container `{service.name}` has no key in a spec"
            service.unread.append(f"{self.place(at)}: {why}")

    def words(self, node: yaml.Node, service: Service) -> list[str]:
        """The words of a command, which may be one text."""
        texts = list(self.texts(node, service))
        if isinstance(node, yaml.SequenceNode):
            return texts
        try:
            return shlex.split(texts[0]) if texts else []
        except ValueError:
            service.unread.append(f"{self.place(node)}: the command has a quote that does not end")
            return []

    def volumes(self, service: Service, at: yaml.Node, value: yaml.Node) -> None:
        for one in _items(value):
            parts = [*self.texts(one, service)] if isinstance(one, yaml.ScalarNode) else []
            here, _, there = parts[0].partition(":") if parts else ("", "", "")
            beside = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), here))
            if parts and re.match(r"/[^:]*:/", parts[0]):
                service.volumes.append(parts[0])
            elif there and here.startswith(".") and self.is_new(service, beside):
                service.files[there.partition(":")[0]] = beside
            else:
                shown = f"{parts[0]} " if parts else ""
                why = "is no folder of the host that its path names from /"
                service.unread.append(f"{self.place(one)}: the volume {shown}of `{service.name}` {why}")

    def is_new(self, service: Service, path: str) -> bool:
        """True for a file of the folder whose name no other one that is delivered has."""
        names = {posixpath.basename(one): one for one in service.files.values()}
        return path in self.folder.texts and names.get(posixpath.basename(path), path) == path

    def environment(self, service: Service, node: yaml.Node) -> None:
        """The variables of a map, or of a list of NAME=VALUE."""
        for name, (key, value) in reversed(pairs_of(node).items()):
            text = None if is_null(value) else next(iter(self.texts(value, service)), None)
            self.variable(service, name, text, self.place(key))
        for one in _items(node) if isinstance(node, yaml.SequenceNode) else ():
            for text in self.texts(one, service):
                name, is_set, given = text.partition("=")
                self.variable(service, name, given if is_set else None, self.place(one))

    def variable(self, service: Service, name: str, text: str | None, place: Place) -> None:
        """Adds a variable; without a text it has the value of the file beside the Compose file."""
        known = self.known.get(name)
        found = known.value if text is None and known else text
        is_known = found is not None and not _VARIABLE.search(found)
        service.environment[name] = Setting(name, found if is_known else None, place)

    def add_file(self, name: str, at: Place, service: Service) -> None:
        found = self.file(name)
        path = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), name))
        if path not in self.folder.texts:
            service.unread.append(f"{at}: {name} of `{service.name}` is not here")
        service.environment.update(found)

    def texts(self, node: yaml.Node, service: Service) -> Iterator[str]:
        """The texts of a value or of a list of them, with the variables in it; one that is unknown stays."""
        for one in _items(node):
            path = pairs_of(one).get("path", (None, None))[1]  # of a long env_file
            scalar = path if isinstance(path, yaml.ScalarNode) else one
            if not isinstance(scalar, yaml.ScalarNode):
                service.unread.append(f"{self.place(one)}: a value of `{service.name}` in its long form")
                continue
            yield self.filled(scalar, service)

    def filled(self, node: yaml.ScalarNode, service: Service) -> str:
        """The text with its variables."""
        unknown: list[str] = []
        defaults: list[str] = []

        def value(match: re.Match[str]) -> str:
            if match[1]:
                return "$"
            name = match[2] or match[3]
            known = self.known.get(name)
            if known is not None and known.value is not None:
                return known.value
            if match[4] in (":-", "-"):
                defaults.append(match[0])
                return str(match[5])
            unknown.append(match[0])
            return match[0]

        text = _VARIABLE.sub(value, node.value)
        place = self.place(node)
        if unknown:
            name = unknown[0]
            service.unread.append(f"{place}: a value of `{service.name}` depends on the variable {name}")
        for one in dict.fromkeys(defaults):
            shown = "a default that may be a secret" if is_secret(one, one) else one
            service.unread.append(f"{place}: {shown} of `{service.name}`; here its variable is not set")
        return text


def _items(node: yaml.Node) -> list[yaml.Node]:
    return node.value if isinstance(node, yaml.SequenceNode) else [node]


def _merged(node: yaml.Node, depth: int = 0) -> dict[str, tuple[yaml.Node, yaml.Node]]:
    """The pairs of a mapping with those that `<<` brings, which what is written wins over."""
    own = dict(reversed(pairs_of(node).items()))
    _, brought = own.pop("<<", (None, None))
    found: dict[str, tuple[yaml.Node, yaml.Node]] = {}
    for one in _items(brought) if brought is not None and depth < _DEPTH else ():
        found = {**_merged(one, depth + 1), **found}
    return {**found, **own}
