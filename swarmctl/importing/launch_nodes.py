"""Drafts a spec from launch files and scripts with ROS variables."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.env_files import env_of, is_env_file
from swarmctl.importing.fkie_settings import FkieSettings
from swarmctl.importing.known_drivers import driven_type
from swarmctl.importing.lab_folder import LAUNCH, LabFolder
from swarmctl.importing.lab_hosts import EXAMPLE, LabHosts, address_of, number
from swarmctl.importing.launch_programs import left_out, program_fields
from swarmctl.importing.robot_lines import line_of
from swarmctl.importing.ros_variables import own_address
from swarmctl.importing.unknown_values import Unknown
from swarmctl.render.ros1.multimaster.fkie_packages import FAMILIES
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.ros_packages.launch_files import evaluate
from swarmctl.ros_packages.launched import Launched, Machine, Node, Place, Refusal
from swarmctl.ros_packages.package import Package
from swarmctl.swarm.addresses import ip_of, means_self
from swarmctl.swarm.names import robot_namespace, valid_name

_LIMIT = 20_000  # elements of all launch files together
_ALL = "the-imported-folder"  # as a package, so that its launch files may include each other
_ONE_MASTER = "roslaunch starts the nodes of every <machine> with the master where it runs"
_GENERAL = {"setup", "env", "environment", "ros", "bashrc", "ros-env", "ros-setup", "local-setup"}
_OF_SCRIPTS = re.compile(r"[-_](env|environment|setup|ros|bashrc)$")  # k3_env.sh
_OF_NODES = re.compile(r"(_(driver|node|base|robot))+$")
_MULTIMASTERS = {
    node.package: packages for packages, one in FAMILIES.items() for node in (one.discovery, one.sync)
}


def draft_from_launch(folder: LabFolder, types: Mapping[str, RobotType]) -> Draft:
    """Returns the draft from the launch files and scripts of a folder; ``types`` are the robot types."""
    launched = _launched(folder)
    unknown = {
        (_normal(place), key): why for one in launched.values() for (place, key), why in one.unknown.items()
    }
    lab = _Lab(types, unknown)
    for machine in (machine for one in launched.values() for machine in one.machines):
        lab.add_machine(machine)
    lab.add_scripts(folder)
    for path, node in _nodes(launched):
        if node.certain and node.package in _MULTIMASTERS:
            lab.fkie.add_hosts(node, launched[path])
    if not lab.draft.hosts and any(one.nodes for one in launched.values()):
        why = "no file names a computer; write each, and which one starts what"
        lab.hosts.new("robot-pc", None, {"address": Value(EXAMPLE, fill_in=why)}, "it starts all nodes")
    lab.add_nodes(launched)
    lab.draft.unread += (*lab.unknown.unread(), *_unread(launched))
    return lab.draft


class _Lab:
    def __init__(self, types: Mapping[str, RobotType], unknown: Mapping[tuple[Place, str], str]) -> None:
        self.types = types
        self.unknown = Unknown(unknown)
        self.draft = Draft("launch files and scripts")
        self.hosts = LabHosts(self.draft)
        self.fkie = FkieSettings(self.draft, self.hosts)
        self.machines: dict[str, str] = {}  # hosts by the names of roslaunch
        self.folders: dict[str, set[str]] = {}  # hosts by the folders of their scripts
        self.namespaces: dict[tuple[str, str], str] = {}  # robots by host and namespace
        self.default = ""  # the host of nodes that name no machine
        self.hub = ""  # where roslaunch runs

    def add_machine(self, machine: Machine) -> None:
        """Adds the computer of a <machine>."""
        name, place = machine.name, _normal(machine.place)
        if name is None:
            return
        address = Value(EXAMPLE) if machine.address is None else address_of(machine.address, place)
        fields = {
            "address": self.unknown.filled(address, place, *([] if machine.certain else ["if"]), "address")
        }
        if machine.user != "":
            fields["user"] = self.unknown.filled(Value(machine.user or "robot", place), place, "user")
        if machine.port != "":
            fields["port"] = self.unknown.filled(
                Value(number(machine.port or "22"), place), place, "ssh-port"
            )
        called = name.replace(".", "-")  # a name of roslaunch, which has no domain
        self.machines[name] = self.hosts.add(called, place, fields)
        if machine.has_password:
            self.draft.unread.append(f"{place}: its password is a secret")
        if machine.is_default and machine.certain:
            self.default = self.machines[name]

    def add_scripts(self, folder: LabFolder) -> None:
        """Adds hosts and masters of scripts. One without an address of a host holds for all hosts."""
        masters: list[tuple[str, Value]] = []
        for path in folder.candidates():
            if not path.endswith(LAUNCH) and is_env_file(folder.texts[path]):
                env, unread = env_of(path, folder.texts[path])
                self.draft.unread += unread
                host = self._host_of_script(path, env)
                if "ROS_MASTER_URI" in env:
                    masters.append((host, env["ROS_MASTER_URI"]))
        for host, uri in sorted(masters, key=lambda one: not one[0]):  # what holds for one host comes first
            self.hosts.add_master([host] if host else list(self.draft.hosts), uri)
        hubs = {str(one.value) for one in self.draft.masters.values()}
        self.hub = min(hubs) if len(hubs) == 1 else "" if hubs else self.default

    def _host_of_script(self, path: str, env: Mapping[str, Value]) -> str:
        """Adds the host that the variables of a script are for; returns its name, empty if they name none."""
        addresses = {key: own_address(one) for key, one in env.items() if key != "ROS_MASTER_URI"}
        called_by = addresses.get("ROS_HOSTNAME")
        own = addresses.get("ROS_IP") or called_by
        if own is None or means_self(own.value):
            return ""
        folder, file = posixpath.split(path)
        stem = _OF_SCRIPTS.sub("", file.partition(".")[0])
        called = posixpath.basename(folder) if valid_name(stem, "host") in _GENERAL else stem
        name = str((called_by or own).value)
        if called_by and called_by.needed and called_by is not own:
            self.draft.unread.append(f"{called_by.place}: ROS_HOSTNAME; ROS needs {called_by.needed}")
        guess = f"its script is {path}" if called and ip_of(name) else ""
        host = self.hosts.add(called if guess else name, own.place, {"address": own}, guess)
        self.folders.setdefault(folder, set()).add(host)
        return host

    def add_nodes(self, launched: Mapping[str, Launched]) -> None:
        """Adds robots, then programs, which may name robots, and the master of machines."""
        programs: list[tuple[Node, Value]] = []
        for path, node in _nodes(launched):
            kind = driven_type(node.package or "", node.executable or "", self.types)
            packages = _MULTIMASTERS.get(node.package or "")
            if None in (node.package, node.executable, node.name):
                if not self.unknown.has(node.place, "pkg", "type", "name"):
                    self.draft.unread.append(f"{node.place}: its namespace is not known here")
            elif not node.certain and (kind or packages):
                continue
            elif kind:
                self._add_robot(node, self._host_of(node, path), kind)
            elif packages:
                host = self._named_host_of(node, path)
                self.fkie.add(
                    node, launched[path], packages, "" if host is None or host.fill_in else host.value
                )
            else:
                programs.append((node, self._host_of(node, path)))
        for node, host in programs:
            self._add_program(node, host)
        if self.hub:
            hub = Value(self.hub, guess=_ONE_MASTER)
        elif self.draft.masters or self.draft.multimaster:
            return
        else:
            hub = Value(
                next(iter(self.draft.hosts), ""), guess=_ONE_MASTER, fill_in="where roslaunch is started"
            )
        self.draft.masters = {**dict.fromkeys(self.machines.values(), hub), **self.draft.masters}

    def _host_of(self, node: Node, path: str) -> Value:
        """The host of a node: that of its machine, or where its launch file is started."""
        if found := self._named_host_of(node, path):
            return found
        if self.hub:
            why = "nodes without `machine` start where roslaunch runs, often on the master's host"
            return Value(self.hub, guess=why)
        return Value(next(iter(self.draft.hosts)), fill_in=f"the host on which {path} is started")

    def _named_host_of(self, node: Node, path: str) -> Value | None:
        """The host that the machine of a node or the path of its launch file shows."""
        if node.machine is None:
            return self.unknown.filled(Value(next(iter(self.draft.hosts))), node.place, "machine")
        if node.machine in self.machines:
            return Value(self.machines[node.machine], node.place)
        if node.machine:
            why = f"no <machine> is called {node.machine} ({node.place})"
            return Value(next(iter(self.draft.hosts)), fill_in=why)
        if self.default:
            return Value(self.default, node.place)
        if len(self.draft.hosts) == 1:
            return Value(next(iter(self.draft.hosts)), guess="it is the only host")
        folder, file = posixpath.split(path)
        beside = self.folders.get(folder, set())
        if len(beside) == 1:
            return Value(min(beside), guess=f"{path} lies beside the ROS variables of this host")
        for part in (file.partition(".")[0], *reversed(folder.split("/"))):
            if part and (host := self.hosts.find(part) or self.hosts.find(valid_name(part, "host"))):
                return Value(host, guess=f"{path} is called like this host")
        return None

    def _add_robot(self, node: Node, host: Value, kind: str) -> None:
        namespace, _, last = (node.name or "").strip("/").rpartition("/")
        called = namespace.rpartition("/")[2] or _OF_NODES.sub("", last) or kind
        name = named(called, "robot", node.place, self.draft.robots)
        why = f"{node.package}/{node.executable} is named like a driver of this type"
        fields = {"type": Value(kind, node.place, why), "host": host}
        line = line_of(name.value, host.value, self.types[kind], node.parameters)
        if host.fill_in and not line.fill_in:
            line = replace(line, guess=f"`{host.value}` stands for its host, which is to fill in")
        if namespace:
            is_new = namespace not in {one for _, one in self.namespaces}
            if is_new and robot_namespace(name.value, None) != f"/{namespace}":
                fields["namespace"] = Value(namespace, node.place)
            self.namespaces[host.value, namespace] = name.value
        self.draft.robots[name.value] = Entry(name, fields)
        self.draft.lines.append(line)
        used = {str(one).lower() for one in line.value.values()}
        unused = [one.name for one in node.parameters if (one.value or "").lower() not in used]
        if unused:
            why = "swarmctl's own driver replaces the node"
            self.draft.unread.append(f"{node.place}: {', '.join(unused)}: {why}")

    def _add_program(self, node: Node, host: Value) -> None:
        """Adds a program; in the namespace of a robot it is that robot's, on any host."""
        namespace, _, last = (node.name or "").strip("/").rpartition("/")
        robots = {robot for (_, one), robot in self.namespaces.items() if one == namespace}
        here = self.namespaces.get((host.value, namespace), "")
        robot = here or (min(robots) if len(robots) == 1 else "")
        fields = {"robot": Value(robot, node.place)} if robot else {}
        fields |= {} if here else {"host": host}
        fields |= program_fields(node)
        if node.arguments is None:
            fields["args"] = self.unknown.filled(Value([]), node.place, "args")
        if namespace and not robot:
            fields["namespace"] = Value(namespace, node.place)
        name = named(last, "node", node.place, {*self.draft.programs, *self.draft.robots})
        name = name if node.certain else self.unknown.filled(name, node.place, "if")
        self.draft.programs[name.value] = Entry(name, fields)
        self.draft.unread += left_out(node, self.unknown)


def _launched(folder: LabFolder) -> Mapping[str, Launched]:
    """What each launch file brings that no other one includes, by its path."""
    texts = {path: text.encode() for path, text in folder.texts.items()}
    whole = Package(_ALL, "", frozenset(), dict.fromkeys(texts, False), texts)
    packages = {**folder.packages.by_name, _ALL: whole}
    left, found = _LIMIT, dict[str, Launched]()
    for path in sorted(one for one in folder.candidates() if one.endswith(LAUNCH)):
        found[path] = evaluate(whole, path, {}, "/", packages, limit=left)
        left -= found[path].cost
    included = {
        file for path, one in found.items() for file in map(posixpath.normpath, one.files) if file != path
    }
    return {path: one for path, one in found.items() if path not in included}


def _nodes(launched: Mapping[str, Launched]) -> Iterator[tuple[str, Node]]:
    """Every node once, with the launch file that starts it."""
    seen: set[tuple[str | None, str | None, Place]] = set()
    for path, one in launched.items():
        for node in one.nodes:
            key = (node.name, node.machine, node.place)
            if key not in seen:
                seen.add(key)
                settings = tuple(replace(one, place=_normal(one.place)) for one in node.parameters)
                texts = tuple(replace(one, place=_normal(one.place)) for one in node.rosparams)
                place = _normal(node.place)
                yield path, replace(node, place=place, parameters=settings, rosparams=texts)


def _unread(launched: Mapping[str, Launched]) -> Iterator[str]:
    for path, one in launched.items():
        if not one.files and not one.faults:
            yield f"{path}: it, or all launch files together, are too large"
        unfound = (place for place in one.unfound if (place, "file") not in one.unknown)
        yield from (f"{_normal(place)}: the included file is not here" for place in unfound)
        for fault in one.faults:
            if fault.kind is Refusal.MISSING:
                yield f"{_normal(fault.place)}: the argument `{fault.subject}` is given when it is launched"
            elif fault.kind in (Refusal.BROKEN, Refusal.SKIPPED):
                yield f"{_normal(fault.place)}: {fault.text}"


def _normal(place: Place) -> Place:
    return Place(posixpath.normpath(place.file), place.line)
