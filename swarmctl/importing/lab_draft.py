"""A draft of what a lab starts, on which hosts."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from swarmctl.importing.compose_services import Service
from swarmctl.importing.draft import Draft, Entry, Value, named
from swarmctl.importing.fkie_settings import FkieSettings
from swarmctl.importing.lab_folder import own_address
from swarmctl.importing.lab_hosts import EXAMPLE, LabHosts, address_of, number
from swarmctl.importing.lab_scripts import Started
from swarmctl.importing.launched_files import Found, file_of, nodes_in, normal, reasons
from swarmctl.importing.node_programs import component_fields, left_out, program_fields, why_left_out
from swarmctl.importing.recognition import driven_type, drivers_of, line_of, unknown_line
from swarmctl.importing.shell_script import Remote
from swarmctl.importing.unknown_values import Unknown, is_secret
from swarmctl.render.ros1.multimaster.fkie import FAMILIES
from swarmctl.robot_types.any_robot_type import AnyRobotType, with_protocol
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import escaped
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.ros_packages.launch_files import (
    Include,
    Launched,
    Machine,
    Node,
    Place,
)
from swarmctl.swarm.addresses import ip_of, means_self
from swarmctl.swarm.names import robot_namespace, valid_name

_ONE_MASTER = "roslaunch starts the nodes of every <machine> with the master where it runs"
_GENERAL = {"setup", "env", "environment", "ros", "bashrc", "ros-env", "ros-setup", "local-setup"}
_OF_SCRIPTS = re.compile(r"[-_](env|environment|setup|ros|bashrc)$")  # k3_env.sh
_OF_NODES = re.compile(r"(_(driver|node|base|robot))+$")
_NAMESPACES = ("namespace", "robot_namespace")  # arguments of launch files
_OF_SIMULATION = re.compile(r"(^|[/_.-])(sim|simulation|simulated|gazebo|gz|old|legacy|deprecated)([/_.-]|$)")
_OF_LAUNCH = re.compile(r"[-_]launch$")
MULTIMASTERS = {
    node.package: packages for packages, one in FAMILIES.items() for node in (one.discovery, one.sync)
}


class Lab:
    """A draft of what launch files and scripts start."""

    def __init__(self, types: Mapping[str, AnyRobotType], found: Found, draft: Draft) -> None:
        self.types = with_protocol(types)
        self.ros_types = {name: one for name, one in types.items() if isinstance(one, RosRobotType)}
        self.drivers = drivers_of(types)
        self.unknown = Unknown(reasons(found.launched))
        self.draft = draft
        self.draft.files |= found.files
        self.hosts = LabHosts(self.draft)
        self.fkie = FkieSettings(self.draft, self.hosts)
        self.machines: dict[str, str] = {}  # hosts by the names of roslaunch
        self.folders: dict[str, set[str]] = {}  # hosts by the folders of their scripts
        self.started_on: dict[str, Value] = {}  # hosts by what starts nodes on them
        self.namespaces: dict[tuple[str, str], str] = {}  # robots by host and namespace
        for name, robot in self.draft.robots.items():
            own = robot.fields.get("namespace")
            of_robot = robot_namespace(name, str(own.value) if own else None).strip("/")
            self.namespaces[str(robot.fields["host"].value), of_robot] = name
        self.default = ""  # the host of nodes that name no machine
        self.hub = ""  # where roslaunch runs
        self.simulations: set[str] = set()  # files, beside others that start nodes

    def add_machine(self, machine: Machine) -> None:
        """Adds the computer of a <machine>."""
        name, place = machine.name, normal(machine.place)
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
        files = {*map(file_of, launched)}
        simulated = {one for one in files if _OF_SIMULATION.search(one)}
        self.simulations = simulated if files - simulated else set()
        programs: list[tuple[Node, Value, Sequence[str]]] = []
        for paths, node in nodes_in(launched, self.started_on):
            path = self.unknown.path = paths[0]
            kind = driven_type(node.package or "", node.executable or "", self.types)
            packages = MULTIMASTERS.get(node.package or "")
            if None in (node.package, node.executable):
                if not self.unknown.has(node.place, "pkg", "exec", "type", "name"):
                    self.draft.unread.append(f"{node.place}: its name is not known here")
            elif (not node.certain or (node.name is None and node.last is None)) and (kind or packages):
                continue
            elif kind:
                self._add_robot(node, self._host_of(node, path), kind)
            elif packages:
                host = self._named_host_of(node, path)
                self.fkie.add(
                    node, launched[path], packages, "" if host is None or host.fill_in else host.value
                )
            else:
                programs.append((node, self._host_of(node, path), paths))
        for node, host, paths in programs:
            self.unknown.path = paths[0]
            self._add_program(node, host, self._starters(paths))
        for path, one in launched.items():
            self.unknown.path = path
            for include in one.includes:
                self._add_include(include, path)
        self.unknown.path = ""

    def add_any_host(self, guess: str) -> None:
        """Adds a host to fill in if no file names one."""
        if not self.draft.hosts:
            why = "nothing that is read names a computer; write each, and which one starts what"
            self.hosts.new("robot-pc", None, {"address": Value(EXAMPLE, fill_in=why)}, guess)

    def add_services(
        self, services: Mapping[str, tuple[Service, Started]], variables: Mapping[str, Value]
    ) -> None:
        """Adds the program of each container but of one whose robot is in the draft.

        ``variables`` are those of the swarm; what a container has otherwise is in its environment.
        """
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
            if service.files:
                delivered = {posixpath.basename(one): one for one in service.files.values()}
                fields["files"] = Value(delivered, service.place)
                self.draft.files |= {*service.files.values()}
            fields["container"] = Value(service.container, service.place, fill_in=why)
            kept = {}
            for one in service.environment.values():
                if why := why_left_out(one):
                    self.draft.unread.append(f"{one.place}: {one.name} of `{service.name}` {why}")
                elif one.name not in service.of_swarm or not _same(one.value, variables.get(one.name)):
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
                place = normal(two.place)
                if (two.place, two.name) in of_nodes:
                    continue
                if two.name.strip("/") == "use_sim_time" and (two.value or "").lower() in ("true", "1"):
                    self.draft.last["ros"] = Value({"use_sim_time": True}, place)
                elif not self.unknown.has(place, "value", two.name):
                    why = f"({two.value}) is of no node; write it as `params` of those that read it"
                    self.draft.unread.append(f"{place}: {two.name} {why_left_out(two) or why}")
            for text in one.rosparams:
                if text.place not in texts:
                    shown = f" {text.name}" if text.name else ""
                    why = "is of no node; write it as `params` of those that read it"
                    self.draft.unread.append(f"{normal(text.place)}: rosparam{shown} {why}")

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
        place, file = normal(include.place), posixpath.basename(include.file)
        if not include.package:
            self._leave_include(include)
            return
        drivers = self.drivers.get((include.package, file), {})
        if drivers and not include.certain:
            return  # what it depends on is not read
        host = self._host_of(Node("", "", "", (), place, include.certain), path)
        given: dict[str, str] = {}
        for one in include.environment:
            if why := "the driver of the type sets what it needs" if drivers else why_left_out(one):
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
            self._add_launch(include, given, host, path)

    def _leave_include(self, include: Include) -> None:
        """Lists an include of a file that is neither here nor in a package, with what it gets."""
        place, name = normal(include.place), include.file if include.file not in ("", ".") else "the file"
        inside = f", for the namespace {include.namespace}" if include.namespace else ""
        if inside or not self.unknown.has(place, "file"):
            self.draft.unread.append(f"{place}: {name} is not here{inside}")
        given = [(key, value, place) for key, value in include.arguments.items()]
        given += [(one.name, one.value, normal(one.place)) for one in include.environment]
        for key, value, at in given:
            shown = "" if value is None or is_secret(key, value) else f" = {value}"
            self.draft.unread.append(f"{at}: {key}{shown}, which {name} gets")

    def _add_driver(
        self, include: Include, given: Mapping[str, str], drivers: Mapping[str, RosDriver], host: Value
    ) -> None:
        """Adds the robot of an included driver; ``drivers`` are those of the types that have it, by type."""
        place, file = normal(include.place), posixpath.basename(include.file)
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

    def _add_launch(self, include: Include, given: Mapping[str, str], host: Value, path: str) -> None:
        """Adds the program of an included launch file."""
        place, file = normal(include.place), posixpath.basename(include.file)
        namespace = (include.namespace or "").strip("/")
        taken = {*self.draft.programs, *self.draft.robots}
        starters = self._starters([path])
        guess = self._of_simulation(starters)
        name = named(_OF_LAUNCH.sub("", file.partition(".")[0]), "node", place, taken, guess)
        name = replace(name, by=_shown(starters, place.file))
        fields = self._where(namespace, host, place)
        fields |= {"package": Value(include.package, place), "launch": Value(file, place)}
        if given:
            fields["args"] = Value({key: escaped(one) for key, one in given.items()}, place)
        variables = {
            one.name: escaped(one.value or "") for one in include.environment if not why_left_out(one)
        }
        if variables:
            fields["environment"] = Value(variables, place)
        if include.namespace is None:
            fields["namespace"] = self.unknown.filled(Value("robot"), place, "namespace")
        elif namespace and "robot" not in fields:
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

    def _starters(self, paths: Sequence[str]) -> Sequence[str]:
        """The files that start a node: first those that are no simulation, by their names."""
        return sorted(dict.fromkeys(map(file_of, paths)), key=lambda one: one in self.simulations)

    def _of_simulation(self, starters: Sequence[str]) -> str:
        """Why a program is only guessed; empty if a file that is no simulation starts it."""
        is_simulated = starters[0] in self.simulations
        return "it is of a simulation, or an old one, by the name of what starts it" if is_simulated else ""

    def _where(self, namespace: str, host: Value, place: Place) -> dict[str, Value]:
        """The robot whose namespace this is, and the host, unless it is that of the robot."""
        robots = {robot for (_, one), robot in self.namespaces.items() if one == namespace}
        here = self.namespaces.get((host.value, namespace), "")
        robot = here or (min(robots) if len(robots) == 1 else "")
        if not robot:
            return {"host": host}
        if host.fill_in and not self.draft.robots[robot].fields["host"].fill_in:
            return {"robot": Value(robot, place, "it has the robot's namespace; its host may start it")}
        return {"robot": Value(robot, place), **({} if here else {"host": host})}

    def _add_program(self, node: Node, host: Value, starters: Sequence[str]) -> None:
        """Adds a program; in the namespace of a robot it is that robot's, on any host."""
        namespace, _, last = (node.name or node.last or node.executable or "").strip("/").rpartition("/")
        fields = self._where(namespace, host, node.place)
        fields |= component_fields(node, namespace) if node.is_component else program_fields(node)
        if node.arguments is None or not node.is_whole:
            key, known = ("args", []) if node.package else ("command", [node.executable])
            known = fields[key].value if key in fields else known
            fields[key] = self.unknown.filled(Value(known), node.place, "args")
        if node.name is None and self.unknown.has(node.place, "namespace"):
            fields["namespace"] = self.unknown.filled(Value("robot"), node.place, "namespace")
        elif namespace and "robot" not in fields:
            fields["namespace"] = Value(namespace, node.place)
        of = "its executable" if last == node.executable else "what its parameter file calls it"
        guess = "" if node.has_name else f"its launch file names no node; this is {of}"
        guess = "; ".join(filter(None, (guess, self._of_simulation(starters))))
        is_named = node.name is not None or node.last is not None
        name = named(last, "node", node.place, {*self.draft.programs, *self.draft.robots}, guess)
        if not (node.certain and is_named):
            name = self.unknown.filled(name, node.place, *([] if node.certain else ["if"]), "name")
        name = replace(name, by=_shown(starters, node.place.file))
        self.draft.programs[name.value] = Entry(name, fields)
        self.draft.unread += left_out(node, self.unknown)


def _shown(starters: Sequence[str], file: str) -> str:
    """The files that start something, but for the one that it stands in."""
    others = [one for one in starters if one != file]
    return ", ".join(others[:2]) + (" and others" if others[2:] else "")


def _same(text: str | None, value: Value | None) -> bool:
    """True unless a variable of the swarm has another value."""
    return value is None or str(value.value) == text
