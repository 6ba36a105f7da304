"""Drafts a spec from launch files and scripts with ROS variables."""

from __future__ import annotations

import json
import math
import posixpath
import re
import shlex
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeGuard

import yaml

from swarmctl.importing.compose_services import Service, is_compose, is_compose_of_ros_1, services_of
from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.fkie_settings import FkieSettings
from swarmctl.importing.lab_folder import LAUNCH, YAML, LabFolder, own_address
from swarmctl.importing.lab_hosts import EXAMPLE, LabHosts, address_of, number
from swarmctl.importing.lab_scripts import Evaluate, Ros, Started, ros_of, started_by
from swarmctl.importing.shell_script import Command, Remote, read_script
from swarmctl.importing.unknown_values import Unknown, is_secret
from swarmctl.links.link_base import RobotLink
from swarmctl.plugins import LINK_KINDS
from swarmctl.render.ros1.multimaster.fkie import FAMILIES
from swarmctl.robot_types.any_robot_type import AnyRobotType, with_protocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import escaped
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.ros_packages.launch_files import (
    Include,
    Launched,
    Machine,
    Node,
    Place,
    Refusal,
    Setting,
    evaluate,
)
from swarmctl.ros_packages.package import Package
from swarmctl.ros_packages.xml_launch import is_of_ros_2
from swarmctl.swarm.addresses import ip_of, means_self
from swarmctl.swarm.names import robot_namespace, valid_name
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.files import LoadBudget


def program_fields(node: Node) -> dict[str, Value]:
    """Returns what a program has of a node whose package and executable are known."""
    values = {
        "package": node.package,
        "executable": node.executable,
        "args": [escaped(word) for word in _words(node) or ()],
        "params": {one.name: _typed(one) for one in node.parameters if not _why_left_out(one)},
        "remap": dict(node.remaps),
        "environment": {
            one.name: escaped(one.value or "") for one in node.environment if not _why_left_out(one)
        },
    }
    return {key: Value(value, node.place) for key, value in values.items() if value}


def _component_fields(node: Node, namespace: str) -> dict[str, Value]:
    """Returns what a program has of a component: it runs in a container of its own."""
    words = ["ros2", "component", "standalone", node.package or "", node.executable or ""]
    words += ["-n", (node.name or node.last or "").rpartition("/")[2]] if node.has_name else []
    words += ["--node-namespace", f"/{namespace}"] if namespace else []
    for old, new in node.remaps:
        words += ["-r", f"{old}:={new}"]
    for one in node.parameters:
        text = one.value or ""
        is_other = one.type == "str" and not isinstance(_read(text), str)  # YAML reads a number, say
        words += [] if _why_left_out(one) else ["-p", f"{one.name}:={json.dumps(text) if is_other else text}"]
    fields = {"command": Value([escaped(one) for one in words], node.place)}
    kept = {one.name: escaped(one.value or "") for one in node.environment if not _why_left_out(one)}
    return fields | ({"environment": Value(kept, node.place)} if kept else {})


def _read(text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):
        return None


def left_out(node: Node, unknown: Unknown) -> Iterator[str]:
    """Says what of a node its program does not have, but for what is ``unknown``."""
    for one in (*node.parameters, *node.environment):
        if not unknown.has(one.place, "value", one.name) and (why := _why_left_out(one)):
            yield f"{one.place}: {one.name} {why}"
    if node.arguments is not None and _words(node) is None:
        yield f"{node.place}: its args may have a secret, or a quote that does not end"
    for text in node.rosparams:
        yield f"{text.place}: its rosparam has no key in a spec; write `params`"


def _why_left_out(one: Setting) -> str:
    """Says why a parameter or a variable is left out; empty if it is not."""
    if one.value is None:
        return "has no value here"
    return "may be a secret" if is_secret(one.name, one.value) else ""


def _words(node: Node) -> Sequence[str] | None:
    """The words of a node's `args`, as roslaunch splits them; None if they are not known, or not shown."""
    if node.arguments is None:
        return None
    found: list[str] = []  # substitutions, of which each is whole

    def mark(match: re.Match[str]) -> str:
        found.append(match[0])
        return f"\0{len(found) - 1}\0"

    try:
        words = shlex.split(_SUBSTITUTION.sub(mark, node.arguments.replace("\0", "")))
    except ValueError:
        return None
    words = [_MARK.sub(lambda one: found[int(one[1])], word) for word in words]
    for word in words:
        name, _, value = word.partition("=")
        if is_secret(name, word) or is_secret(name, value):
            return None
    return words


_QUOTED = re.compile(r"[`\"]([^`\"]*)[`\"]")
_SUBSTITUTION = re.compile(r"\$\((?:find|find-pkg-share|find-pkg-prefix|dirname)\b[^()]*\)")
_MARK = re.compile(r"\0(\d+)\0")


def _typed(one: Setting) -> Any:
    """The value as roslaunch types it: as declared, or the first of int, double, bool that it looks like."""
    text = one.value or ""
    kinds = ("int", "double", "bool") if one.type in ("", "auto") else (one.type,)
    for kind in kinds:
        try:
            if kind == "int":
                return int(text)
            if kind == "double" and math.isfinite(number := float(text)):
                return number
        except ValueError:
            continue
        if kind == "yaml":
            return yaml.safe_load(text)  # a list that an evaluator wrote as JSON
        if kind in {"bool", "boolean"} and text.lower() in {"true", "false"}:
            return text.lower() == "true"
    return escaped(text)


# What people call robots of a type. A plural and two words with `_` or `-` between them count as well.
_CALLED: Mapping[str, str] = {
    "koala": "koala",
    **dict.fromkeys(("khepera3", "kheperaiii", "khepera", "k3"), "khepera3"),
    **dict.fromkeys(("epuck", "mepuck"), "epuck"),
    "epuck2": "epuck2",
}
_TWO_WORDS = re.compile(r"(?<=e)[_-](?=puck)|(?<=khepera)[_-](?=iii|3)|(?<=epuck)[_-](?=2)")
_OF_DRIVERS = re.compile("driver|node|base|serial|robots?|ros|py|cpp|controller|exe|bringup")
_OF_GROUPS = re.compile("robots?|hosts|pis")


def driven_type(package: str, executable: str, types: Collection[str]) -> str:
    """Returns the type of the robot that a node drives; empty if its names do not say so.

    All words of the executable, or of package and executable, name the robot or are words such as `driver`.
    """
    return _type_in(executable, _OF_DRIVERS, types) or _type_in(f"{package} {executable}", _OF_DRIVERS, types)


def type_of_group(group: str, types: Collection[str]) -> str:
    """Returns the type of the robots in a group of hosts called ``group``; empty if no type has its name."""
    return _type_in(group, _OF_GROUPS, types)


def _type_in(name: str, others: re.Pattern[str], types: Collection[str]) -> str:
    """The one type that a name has; empty if a word of it is neither a type's nor one of ``others``."""
    joined = _TWO_WORDS.sub("", name.lower())
    words = [one for one in re.split("[^a-z0-9]+", joined) if one and not others.fullmatch(one)]
    found = {_CALLED.get(one) or _CALLED.get(one.removesuffix("s"), "") for one in words}
    return next(iter(found)) if len(found) == 1 and found <= set(types) else ""


_MAC = re.compile("([0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2}")
_FIXED = ("/dev/ttyS", "/dev/ttyAMA", "/dev/serial0", "/dev/serial1")  # names that the kernel never changes
_BAUD = ("baud", "baudrate", "baud_rate")


def unknown_line(robot: str, host: str, robot_type: AnyRobotType | None, why: str = "") -> Value:
    """Returns the line of a robot as a place to fill in."""
    kind = robot_type.link.kinds[0] if robot_type and robot_type.link else "serial"
    line: type[RobotLink] = LINK_KINDS.get(kind)
    example = {"kind": kind, "host": host, "robot": robot, **line.unknown_end}
    return Value(example, fill_in=f"{why}; {line.where_to_find}" if why else line.where_to_find)


def line_of(robot: str, host: str, robot_type: RobotType, settings: Sequence[Setting]) -> Value:
    """Returns the line that the parameters of a driver name: a Bluetooth address or a fixed device."""
    ends = {"host": host, "robot": robot}
    kinds = robot_type.link.kinds
    for one in settings:
        value = one.value or ""
        if "bluetooth" in kinds and _MAC.fullmatch(value):
            return Value({"kind": "bluetooth", **ends, "mac": value.lower()}, one.place)
        if "serial" in kinds and value.startswith(_FIXED):
            bauds = [int(baud.value) for baud in settings if baud.name in _BAUD and _is_number(baud.value)]
            baud = {"baud": bauds[0]} if bauds else {}
            return Value({"kind": "serial", **ends, "device": value, **baud}, one.place)
        if value.startswith("/dev/"):
            return unknown_line(robot, host, robot_type, f"{one.place} opens a device that may be renamed")
    return unknown_line(robot, host, robot_type)


def _is_number(text: str | None) -> TypeGuard[str]:
    return bool(re.fullmatch("[0-9]{1,9}", text or "", re.ASCII))


_LIMIT = 20_000  # elements of all launch files together
_ALL = "the-imported-folder"  # as a package, so that its launch files may include each other
_ONE_MASTER = "roslaunch starts the nodes of every <machine> with the master where it runs"
_GENERAL = {"setup", "env", "environment", "ros", "bashrc", "ros-env", "ros-setup", "local-setup"}
_OF_SCRIPTS = re.compile(r"[-_](env|environment|setup|ros|bashrc)$")  # k3_env.sh
_OF_NODES = re.compile(r"(_(driver|node|base|robot))+$")
_NAMESPACES = ("namespace", "robot_namespace")  # arguments of launch files
_OF_LAUNCH = re.compile(r"[-_]launch$")
_MULTIMASTERS = {
    node.package: packages for packages, one in FAMILIES.items() for node in (one.discovery, one.sync)
}


def draft_from_launch(
    folder: LabFolder, types: Mapping[str, AnyRobotType], draft: Draft | None = None
) -> Draft:
    """Returns the draft from the launch files and scripts of a folder; ``types`` are the robot types.

    ``draft`` has what an inventory says, if there is one.
    """
    whole, packages = whole_folder(folder)
    closed = driver_files(packages, types)

    def one(
        package: Package, path: str, given: Mapping[str, str | None], namespace: str, limit: int
    ) -> Launched | None:
        if posixpath.normpath(posixpath.join(package.folder, path)) in closed:
            return None
        return evaluate(package, path, given, namespace or "/", packages, limit=limit, closed=closed)

    def read(path: str, limit: int) -> Launched | None:
        if not path.endswith(LAUNCH) or is_of_ros_2(path, folder.texts[path]):
            return None
        return evaluate(whole, path, {}, "/", packages, limit=limit, closed=closed)

    services = services_in(folder, Ros.ONE, types)
    started = [*scripts_of(folder, Ros.ONE, one), *(one for _, one in services.values())]
    every = {**launched_in(folder, read, closed), **{one.key: one.launched for one in started}}
    launched = not_included(every)
    lab = Lab(types, reasons(launched), draft or Draft("launch files and scripts"))
    lab.draft.files |= files_of(folder, every)
    for machine in (machine for one in launched.values() for machine in one.machines):
        lab.add_machine(machine)
    lab.add_scripts(started)
    for path, node in nodes_in(launched):
        if node.certain and node.package in _MULTIMASTERS:
            lab.fkie.add_hosts(node, launched[path])
    if services or any(one.nodes or one.includes for one in launched.values()):
        lab.add_any_host("it starts all nodes")
    lab.add_nodes(launched)
    lab.add_services(services)
    lab.add_masters()
    lab.add_parameters(launched)
    lab.draft.unread += (*lab.unknown.unread(), *unread(launched))
    return lab.draft


def scripts_of(folder: LabFolder, ros: Ros, evaluate: Evaluate) -> Sequence[Started]:
    """Returns what the scripts of one ROS set and start, by computer."""
    whole, packages = whole_folder(folder)
    left, found = _LIMIT, list[Started]()
    for path, script in folder.scripts.items():
        if ros_of(script) in (ros, Ros.EITHER):
            found += started_by(path, script, packages, whole, evaluate, limit=left)
            left = _LIMIT - sum(one.launched.cost for one in found)
    return found


def services_in(
    folder: LabFolder, ros: Ros, types: Mapping[str, AnyRobotType]
) -> Mapping[str, tuple[Service, Started]]:
    """Returns the services of Compose files of one ROS, each with what it sets, and the drivers it starts."""
    found: dict[str, tuple[Service, Started]] = {}
    drivers = drivers_of(types)
    for path in folder.candidates():
        text = folder.texts[path]
        if not path.endswith(YAML) or not is_compose(compose(text, path, LoadBudget())[0]):
            continue
        if (Ros.ONE if is_compose_of_ros_1(text) else Ros.TWO) is not ros:
            continue
        services, others = services_of(folder, path)
        shared = _shared(services)
        for one in services:
            one.of_swarm = shared
            here = started_in(path, one)
            here.variables = dict(shared)
            here.unread |= dict.fromkeys(others)
            here.launched.includes = [
                two
                for two in here.launched.includes
                if (two.package, posixpath.basename(two.file)) in drivers
            ]
            found[here.key] = one, here
    return found


def _shared(services: Sequence[Service]) -> Mapping[str, Value]:
    """The variables of ROS that all services of a file have with the same value; others stay in theirs."""
    first = services[0].variables if services else {}
    return {
        name: one
        for name, one in first.items()
        if all(name in two.variables and two.variables[name].value == one.value for two in services)
    }


def started_in(path: str, service: Service) -> Started:
    """Returns what the command of a service sets and starts."""
    script = read_script(path, {path: shlex.join(service.command)})
    environment = {name: one.value or "" for name, one in service.environment.items() if one.value}
    steps = [
        replace(one, place=service.place, environment=environment)
        if isinstance(one, Command)
        else replace(one, place=service.place)
        for one in script.steps
        if one.remote is None
    ]
    nothing = Package("", "", frozenset(), {}, {})
    made = started_by(path, replace(script, steps=steps), {}, nothing, lambda *_: Launched(), limit=0)
    here = next(iter(made), Started(path, None, service.place))
    here.name, here.launched.nodes, here.unread = service.name, [], dict.fromkeys(service.unread)
    here.launched.files[here.key] = None
    return here


def reasons(launched: Mapping[str, Launched]) -> Mapping[tuple[Place, str], str]:
    """Returns on what the attributes depend that are not known."""
    return {
        (_normal(place), key): why for one in launched.values() for (place, key), why in one.unknown.items()
    }


def drivers_of(types: Mapping[str, AnyRobotType]) -> Mapping[tuple[str, str], Mapping[str, RosDriver]]:
    """Returns the drivers of robot types by package and launch file, then by type."""
    found: dict[tuple[str, str], dict[str, RosDriver]] = {}
    for name, kind in types.items():
        for one in kind.drivers if isinstance(kind, RosRobotType) else ():
            if one.launch:
                found.setdefault((one.package, posixpath.basename(one.launch)), {})[name] = one
    return found


def driver_files(packages: Mapping[str, Package], types: Mapping[str, AnyRobotType]) -> Mapping[str, str]:
    """Returns the packages of those launch files of a folder that are the driver of a robot type."""
    return {
        posixpath.normpath(posixpath.join(packages[name].folder, path)): name
        for name, file in drivers_of(types)
        if name in packages
        for path in packages[name].contents
        if posixpath.basename(path) == file
    }


class Lab:
    """A draft of what launch files and scripts start."""

    def __init__(
        self, types: Mapping[str, AnyRobotType], unknown: Mapping[tuple[Place, str], str], draft: Draft
    ) -> None:
        self.types = with_protocol(types)
        self.ros_types = {name: one for name, one in types.items() if isinstance(one, RosRobotType)}
        self.drivers = drivers_of(types)
        self.unknown = Unknown(unknown)
        self.draft = draft
        self.hosts = LabHosts(self.draft)
        self.fkie = FkieSettings(self.draft, self.hosts)
        self.machines: dict[str, str] = {}  # hosts by the names of roslaunch
        self.folders: dict[str, set[str]] = {}  # hosts by the folders of their scripts
        self.started_on: dict[str, Value] = {}  # hosts by what starts nodes on them
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

    def add_scripts(self, started: Sequence[Started]) -> None:
        """Adds hosts and masters of scripts. One without an address of a host holds for all hosts."""
        masters: list[tuple[str, Value]] = []
        for one in started:
            self.draft.unread += one.unread
            host = self.add_remote(one) if one.remote else self._host_of_script(one.path, one.variables)
            if host:
                self.started_on[one.key] = Value(host, one.place)
            if "ROS_MASTER_URI" in one.variables:
                masters.append((host, one.variables["ROS_MASTER_URI"]))
        for host, uri in sorted(masters, key=lambda one: not one[0]):  # what holds for one host comes first
            self.hosts.add_master([host] if host else list(self.draft.hosts), uri)
        hubs = {str(one.value) for one in self.draft.masters.values()}
        self.hub = min(hubs) if len(hubs) == 1 else "" if hubs else self.default

    def add_remote(self, started: Started) -> str:
        """Adds the computer that a script reaches by ssh; returns its name."""
        remote, place = started.remote or Remote(""), started.place
        address = own_address(Value(remote.address, place))
        fields = {"address": address_of(str(address.value), place)}
        fields |= {"user": Value(remote.user, place)} if remote.user else {}
        fields |= {"port": Value(number(remote.port), place)} if remote.port else {}
        if remote.has_password:
            self.draft.unread.append(f"{place}: its password is a secret")
        if remote.via:
            self.draft.unread.append(f"{place}: it jumps through {remote.via}; write `via` with that host")
        host = self.hosts.add(remote.address, place, fields)
        own = [one for key, one in started.variables.items() if key in ("ROS_IP", "ROS_HOSTNAME")]
        for one in (own_address(one) for one in own):
            if not means_self(one.value):
                self.hosts.add(host, one.place, {"address": one})
        return host

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
        for path, node in nodes_in(launched, self.started_on):
            kind = driven_type(node.package or "", node.executable or "", self.types)
            packages = _MULTIMASTERS.get(node.package or "")
            if None in (node.package, node.executable, node.last if node.name is None else node.name):
                if not self.unknown.has(node.place, "pkg", "exec", "type", "name"):
                    self.draft.unread.append(f"{node.place}: its name is not known here")
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
        for path, one in launched.items():
            for include in one.includes:
                self._add_include(include, path)

    def add_any_host(self, guess: str) -> None:
        """Adds a host to fill in if no file names one."""
        if not self.draft.hosts:
            why = "no file names a computer; write each, and which one starts what"
            self.hosts.new("robot-pc", None, {"address": Value(EXAMPLE, fill_in=why)}, guess)

    def add_services(self, services: Mapping[str, tuple[Service, Started]]) -> None:
        """Adds the program of each container but of one whose robot is in the draft."""
        for key, (service, started) in services.items():
            if started.launched.includes:
                why = "the driver of its robot's type runs without one"
                self.draft.unread.append(f"{service.place}: the container `{service.name}`; {why}")
                continue
            host = self._host_of(Node("", "", "", (), service.place, certain=True), key)
            taken = {*self.draft.programs, *self.draft.robots}
            name = named(service.name, "container", service.place, taken)
            why = f"the digest of its image, as `docker images --digests {service.image}` shows it"
            if not service.image:
                why = "the ID of its image, which is built here, as `docker images --no-trunc` shows it"
            fields = {"host": host}
            if any(is_secret(one.partition("=")[0], one) for one in service.command):
                service.command = []
                self.draft.unread.append(f"{service.place}: its command may have a secret")
            fields["container"] = Value(service.container, service.place, fill_in=why)
            kept = {}
            for one in service.environment.values():
                if why := _why_left_out(one):
                    self.draft.unread.append(f"{one.place}: {one.name} of `{service.name}` {why}")
                elif one.name not in service.of_swarm:
                    kept[one.name] = escaped(one.value or "")
            if kept:
                fields["environment"] = Value(kept, service.place)
            self.draft.programs[name.value] = Entry(name, fields)

    def add_parameters(self, launched: Mapping[str, Launched]) -> None:
        """Adds whether nodes take the time from `/clock`, and lists parameters of no node."""
        for one in launched.values():
            of_nodes = {(two.place, two.name) for node in one.nodes for two in node.parameters}
            texts = {two.place for node in one.nodes for two in node.rosparams}
            for two in one.parameters:
                place = _normal(two.place)
                if (two.place, two.name) in of_nodes:
                    continue
                if two.name.strip("/") == "use_sim_time" and (two.value or "").lower() in ("true", "1"):
                    self.draft.last["ros"] = Value({"use_sim_time": True}, place)
                elif not self.unknown.has(place, "value", two.name):
                    why = f"({two.value}) is of no node; write it as `params` of those that read it"
                    self.draft.unread.append(f"{place}: {two.name} {_why_left_out(two) or why}")
            for text in one.rosparams:
                if text.place not in texts:
                    shown = f" {text.name}" if text.name else ""
                    why = "is of no node; write it as `params` of those that read it"
                    self.draft.unread.append(f"{_normal(text.place)}: rosparam{shown} {why}")

    def add_masters(self) -> None:
        """Adds the master of each machine: roslaunch starts all nodes with one."""
        if self.hub:
            hub = Value(self.hub, guess=_ONE_MASTER)
        elif self.draft.masters or self.draft.multimaster:
            return
        else:
            hub = Value(
                next(iter(self.draft.hosts), ""), guess=_ONE_MASTER, fill_in="where roslaunch is started"
            )
        self.draft.masters = {**dict.fromkeys(self.machines.values(), hub), **self.draft.masters}

    def _add_include(self, include: Include, path: str) -> None:
        """Adds what a file that is not here starts: a robot if it is the driver of a type, else a program."""
        place, file = _normal(include.place), posixpath.basename(include.file)
        if not include.package:
            self._leave_include(include)
            return
        drivers = self.drivers.get((include.package, file), {})
        if drivers and not include.certain:
            return  # what it depends on is not read
        host = self._host_of(Node("", "", "", (), place, include.certain), path)
        given: dict[str, str] = {}
        for one in include.environment:
            if why := "the driver of the type sets what it needs" if drivers else _why_left_out(one):
                self.draft.unread.append(f"{place}: {one.name}: {why}")
        for name, value in include.arguments.items():
            if value is None:
                if not self.unknown.has(place, f"argument {name}"):
                    self.draft.unread.append(f"{place}: the argument `{name}` is not known here")
            elif is_secret(name, value):
                self.draft.unread.append(f"{place}: {name} may be a secret")
            else:
                given[name] = value
        if drivers:
            self._add_driver(include, given, drivers, host)
        else:
            self._add_launch(include, given, host)

    def _leave_include(self, include: Include) -> None:
        """Lists an include of a file that is neither here nor in a package, with what it gets."""
        place, name = _normal(include.place), include.file if include.file not in ("", ".") else "the file"
        inside = f", for the namespace {include.namespace}" if include.namespace else ""
        if inside or not self.unknown.has(place, "file"):
            self.draft.unread.append(f"{place}: {name} is not here{inside}")
        given = [(key, value, place) for key, value in include.arguments.items()]
        given += [(one.name, one.value, _normal(one.place)) for one in include.environment]
        for key, value, at in given:
            shown = "" if value is None or is_secret(key, value) else f" = {value}"
            self.draft.unread.append(f"{at}: {key}{shown}, which {name} gets")

    def _add_driver(
        self, include: Include, given: Mapping[str, str], drivers: Mapping[str, RosDriver], host: Value
    ) -> None:
        """Adds the robot of an included driver; ``drivers`` are those of the types that have it, by type."""
        place, file = _normal(include.place), posixpath.basename(include.file)
        arguments = (*(one.namespace_argument or "" for one in drivers.values()), *_NAMESPACES)
        inner = next((given[one] for one in arguments if one in given), "")
        namespace = (include.namespace or "").strip("/") or inner.strip("/")
        kind, *others = drivers
        name = named(namespace.rpartition("/")[2] or kind, "robot", place, self.draft.robots)
        why = f"its driver is {file} of {include.package}"
        why += f", as of {', '.join(others)}" if others else ""
        fields = {"type": Value(kind, place, why), "host": host}
        if include.namespace is None:
            fields["namespace"] = self.unknown.filled(Value("robot"), place, "namespace")
        elif namespace and robot_namespace(name.value, None) != f"/{namespace}":
            fields["namespace"] = Value(namespace, place)
        self.draft.robots[name.value] = Entry(name, fields)
        if self.ros_types[kind].link is not None:
            self.draft.lines.append(unknown_line(name.value, host.value, self.ros_types[kind]))
        if namespace:
            self.namespaces[host.value, namespace] = name.value
        elif include.namespace is not None:
            own = robot_namespace(name.value, None)
            self.draft.unread.append(f"{place}: it has no namespace there; in a spec it has {own}")
        if left := [f"{key} = {given[key]}" for key in sorted(given.keys() - {*arguments})]:
            why = "the driver of the type sets what it needs"
            self.draft.unread.append(f"{place}: {', '.join(left)}: {why}")

    def _add_launch(self, include: Include, given: Mapping[str, str], host: Value) -> None:
        """Adds the program of an included launch file."""
        place, file = _normal(include.place), posixpath.basename(include.file)
        namespace = (include.namespace or "").strip("/")
        taken = {*self.draft.programs, *self.draft.robots}
        name = named(_OF_LAUNCH.sub("", file.partition(".")[0]), "node", place, taken)
        robot = self.namespaces.get((host.value, namespace), "")
        fields = {"robot": Value(robot, place)} if robot else {"host": host}
        fields |= {"package": Value(include.package, place), "launch": Value(file, place)}
        if given:
            fields["args"] = Value({key: escaped(one) for key, one in given.items()}, place)
        variables = {
            one.name: escaped(one.value or "") for one in include.environment if not _why_left_out(one)
        }
        if variables:
            fields["environment"] = Value(variables, place)
        if include.namespace is None:
            fields["namespace"] = self.unknown.filled(Value("robot"), place, "namespace")
        elif namespace and not robot:
            fields["namespace"] = Value(namespace, place)
        name = name if include.certain else self.unknown.filled(name, place, "if")
        self.draft.programs[name.value] = Entry(name, fields)

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
        if path in self.started_on:
            return self.started_on[path]
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
        namespace, _, last = (node.name or node.last or "").strip("/").rpartition("/")
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
        if node.name is None:
            fields["namespace"] = self.unknown.filled(Value("robot"), node.place, "namespace")
        self.draft.robots[name.value] = Entry(name, fields)
        self.draft.lines.append(line)
        used = {str(one).lower() for one in line.value.values()}
        unused = [one.name for one in node.parameters if (one.value or "").lower() not in used]
        if unused:
            why = "swarmctl's own driver replaces the node"
            self.draft.unread.append(f"{node.place}: {', '.join(unused)}: {why}")

    def _add_program(self, node: Node, host: Value) -> None:
        """Adds a program; in the namespace of a robot it is that robot's, on any host."""
        namespace, _, last = (node.name or node.last or "").strip("/").rpartition("/")
        robots = {robot for (_, one), robot in self.namespaces.items() if one == namespace}
        here = self.namespaces.get((host.value, namespace), "")
        robot = here or (min(robots) if len(robots) == 1 else "")
        fields = {"robot": Value(robot, node.place)} if robot else {}
        fields |= {} if here else {"host": host}
        fields |= _component_fields(node, namespace) if node.is_component else program_fields(node)
        if node.arguments is None:
            fields["args"] = self.unknown.filled(Value([]), node.place, "args")
        if node.name is None:
            fields["namespace"] = self.unknown.filled(Value("robot"), node.place, "namespace")
        elif namespace and not robot:
            fields["namespace"] = Value(namespace, node.place)
        guess = "" if node.has_name else "its launch file names no node; this is its executable"
        name = named(last, "node", node.place, {*self.draft.programs, *self.draft.robots}, guess)
        name = name if node.certain else self.unknown.filled(name, node.place, "if")
        self.draft.programs[name.value] = Entry(name, fields)
        self.draft.unread += left_out(node, self.unknown)


def launched_in(
    folder: LabFolder, read: Callable[[str, int], Launched | None], closed: Mapping[str, str]
) -> Mapping[str, Launched]:
    """Returns what each launch file brings, by its path. ``read`` returns None for what is none.

    One of the files ``closed`` brings its robot, and not what its driver starts.
    """
    left, found = _LIMIT, dict[str, Launched]()
    for path in sorted(folder.candidates()):
        one = read(path, left)
        if one is not None:
            left -= one.cost
            found[path] = one
        if one is not None and path in closed:
            include = Include(closed[path], posixpath.basename(path), "", {}, Place(path, 0), certain=True)
            why = "what it starts, which the driver of a robot's type is"
            found[path] = Launched(files=one.files, includes=[include], left_out=[(include.place, why)])
    return found


def whole_folder(folder: LabFolder) -> tuple[Package, Mapping[str, Package]]:
    """Returns the files of a folder as one package, and all packages that launch files may name."""
    texts = {path: text.encode() for path, text in folder.texts.items()}
    whole = Package(_ALL, "", frozenset(), dict.fromkeys(texts, False), texts)
    found = {name: _with_texts(one, texts) for name, one in folder.packages.by_name.items()}
    return whole, {**found, _ALL: whole}


def _with_texts(package: Package, texts: Mapping[str, bytes]) -> Package:
    """A package with those files of the folder that lie in it."""
    inside = "" if package.folder == "." else f"{package.folder}/"
    own = {path[len(inside) :]: text for path, text in texts.items() if path.startswith(inside)}
    return replace(package, contents={**package.contents, **own})


def files_of(folder: LabFolder, launched: Mapping[str, Launched]) -> set[str]:
    """Returns the files that launch files and scripts include."""
    included = {posixpath.normpath(file) for one in launched.values() for file in one.files}
    return included | {other for one in folder.scripts.values() for other in one.others}


def not_included(found: Mapping[str, Launched]) -> Mapping[str, Launched]:
    """Returns what each launch file starts that no other one includes."""
    included = {
        file for path, one in found.items() for file in map(posixpath.normpath, one.files) if file != path
    }
    return {path: one for path, one in found.items() if path not in included}


def nodes_in(launched: Mapping[str, Launched], apart: Collection[str] = ()) -> Iterator[tuple[str, Node]]:
    """Every node once, with what starts it; of those that are ``apart`` each starts its own."""
    seen: set[tuple[Node, str]] = set()
    for path, one in launched.items():
        for node in one.nodes:
            key = (node, path if path in apart else "")  # one with other parameters is another one
            if key not in seen:
                seen.add(key)
                settings = tuple(replace(one, place=_normal(one.place)) for one in node.parameters)
                texts = tuple(replace(one, place=_normal(one.place)) for one in node.rosparams)
                place = _normal(node.place)
                yield path, replace(node, place=place, parameters=settings, rosparams=texts)


def unread(launched: Mapping[str, Launched]) -> Iterator[str]:
    """Yields what of launch files a draft does not have."""
    sections: dict[tuple[str, str], bool] = {}
    for one in launched.values():
        sections.update({key: sections.get(key) or is_used for key, is_used in one.sections.items()})
    for (file, key), is_used in sections.items():
        if not is_used:
            yield f"{posixpath.normpath(file)}: its parameters of {key}, as no node here is called"
    for path, one in launched.items():
        if not one.files and not one.faults:
            yield f"{path}: it, or all launch files together, are too large"
        yield from _without_effect(one)
        for place, why in one.left_out:
            is_hidden = any(is_secret(one, one) for one in _QUOTED.findall(why))
            shown = "what it runs may have a secret" if is_hidden else why
            yield f"{_normal(place)}: {shown}"
        unfound = (place for place in one.unfound if (place, "file") not in one.unknown)
        yield from (f"{_normal(place)}: the included file is not here" for place in unfound)
        for fault in one.faults:
            if fault.kind is Refusal.MISSING:
                yield f"{_normal(fault.place)}: the argument `{fault.subject}` is given when it is launched"
            elif fault.kind in (Refusal.BROKEN, Refusal.SKIPPED):
                yield f"{_normal(fault.place)}: {fault.text}"


def _without_effect(launched: Launched) -> Iterator[str]:
    """The remaps and variables of no node."""
    remaps = {pair for node in launched.nodes for pair in node.remaps}
    for (old, new), place in launched.remaps.items():
        if (old, new) not in remaps:
            yield f"{_normal(place)}: the remap from {old} to {new} is of no node here"
    kept = [one.environment for one in launched.nodes] + [one.environment for one in launched.includes]
    variables = {(one.place, one.name) for environment in kept for one in environment}
    for one in launched.environment:
        if (one.place, one.name) not in variables:
            yield f"{_normal(one.place)}: the variable {one.name} is of no node here"


def _normal(place: Place) -> Place:
    return Place(posixpath.normpath(place.file), place.line)
