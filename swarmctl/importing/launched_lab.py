"""Drafts a spec from launch files and scripts with ROS variables."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from swarmctl.importing.allowed_values import is_allowed, name_fact
from swarmctl.importing.arrangement_of_masters import FKIE, Arrangement, arrangement, networks
from swarmctl.importing.draft import Blank, Draft, Entry, Fact, Field, Unread
from swarmctl.importing.env_files import Written, env_of, is_env_file
from swarmctl.importing.known_drivers import driven_type
from swarmctl.importing.lab_folder import LAUNCH, LabFolder
from swarmctl.importing.lab_hosts import LabHosts
from swarmctl.importing.launch_programs import driver_notes, program_of
from swarmctl.importing.robot_lines import line_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.ros_packages.launch_files import evaluate
from swarmctl.ros_packages.launched import Fault, Launched, Node, Place, Refusal
from swarmctl.ros_packages.package import Package
from swarmctl.spec.model import Mode
from swarmctl.swarm.names import robot_namespace

_LIMIT = 20_000  # elements of all launch files together
_ALL = "the-imported-folder"  # as a package, so that its launch files may include each other
_ONE_MASTER = "roslaunch starts the nodes of every <machine> with the master where it runs"
_SUFFIXES = ("_driver", "_node", "_base", "_robot")


@dataclass
class _Found:
    """What the nodes of a lab become."""

    robots: dict[str, Entry] = field(default_factory=dict)
    lines: list[Field] = field(default_factory=list)
    programs: dict[str, Entry] = field(default_factory=dict)
    namespaces: dict[tuple[str, str], str] = field(default_factory=dict)  # robots by host and namespace
    multimaster: Fact | None = None


def draft_from_launch(folder: LabFolder, types: Mapping[str, RobotType]) -> Draft:
    """Returns the draft from the launch files and scripts of a folder; ``types`` are the robot types."""
    launched = _launched(folder)
    hosts = LabHosts()
    for machine in (machine for one in launched.values() for machine in one.machines):
        hosts.add_machine(machine)
    _add_scripts(folder, hosts)
    hubs = {str(one.value) for one in hosts.masters.values()}
    hub = min(hubs) if len(hubs) == 1 else "" if hubs else hosts.default
    nodes = list(_nodes(launched))
    found = _found(
        [(node, _host_of(node, path, hosts, hub)) for path, node in nodes if not _why_not(node)], types
    )
    arranged = _arranged(hosts, hub, found)
    entries = _with_adapters(list(hosts.entries.values()), found.lines)
    unread = [*folder.unread, *hosts.unread, *_unread(launched)]
    unread += [Unread(node.place, why) for _, node in nodes if (why := _why_not(node))]
    if found.multimaster and found.multimaster.place and "multimaster" not in arranged.last:
        unread.append(Unread(found.multimaster.place, "fkie's multimaster has no use with one master"))
    return Draft(
        "launch files and scripts",
        Fact("lab", None, "launch files have no name for the whole"),
        arranged.first,
        entries,
        tuple(found.robots.values()),
        (*networks(entries), *found.lines),
        tuple(found.programs.values()),
        arranged.last,
        tuple(dict.fromkeys(unread)),
        tuple(hosts.notes),
    )


def _found(placed: Sequence[tuple[Node, Field]], types: Mapping[str, RobotType]) -> _Found:
    """Sorts nodes with their hosts into robots, programs, which may name robots, and the multimaster."""
    found = _Found()
    kinds = [driven_type(node.package or "", node.executable or "", types) for node, _ in placed]
    for (node, host), kind in zip(placed, kinds, strict=True):
        if kind:
            _add_robot(found, node, host, kind, types)
    for (node, host), kind in zip(placed, kinds, strict=True):
        if node.package and node.package in FKIE:
            packages = {"packages": FKIE[node.package]}
            found.multimaster = found.multimaster or Fact(packages, node.place)
        elif not kind:
            _add_program(found, node, host)
    return found


def _launched(folder: LabFolder) -> Mapping[str, Launched]:
    """What each launch file brings that no other one includes, by its path."""
    texts = {path: text.encode() for path, text in folder.texts.items()}
    whole = Package(_ALL, "", frozenset(), dict.fromkeys(texts, False), texts)
    packages = {**folder.packages.by_name, _ALL: whole}
    left, found = _LIMIT, dict[str, Launched]()
    for path in sorted(one for one in folder.candidates() if one.endswith(LAUNCH)):
        one = evaluate(whole, path, {}, "/", packages, limit=left)
        left -= one.cost
        found[path] = one
    included = {
        posixpath.normpath(file)
        for path, one in found.items()
        for file in one.files
        if posixpath.normpath(file) != path
    }
    return {path: one for path, one in found.items() if path not in included}


def _add_scripts(folder: LabFolder, hosts: LabHosts) -> None:
    """Adds hosts and masters of scripts. One without an address of a host holds for all hosts."""
    masters: list[tuple[str, Written]] = []
    for path in folder.candidates():
        text = folder.texts[path]
        if path.endswith(LAUNCH) or not is_env_file(text):
            continue
        env, unread, notes = env_of(path, text)
        hosts.unread += unread
        hosts.notes += notes
        host, uri = hosts.add_script(path, env), env.get("ROS_MASTER_URI")
        if uri is not None:
            masters.append((host, uri))
    for host, uri in sorted(masters, key=lambda one: not one[0]):  # what holds for one host comes first
        hosts.add_master([host] if host else list(hosts.entries), uri)


def _masters(hosts: LabHosts, hub: str) -> Mapping[str, Fact]:
    """The host of each one's master: roslaunch gives the machines of a launch file its own master."""
    of_machines = dict.fromkeys(hosts.machines.values(), Fact(hub, None, _ONE_MASTER)) if hub else {}
    return {**of_machines, **hosts.masters}


def _arranged(hosts: LabHosts, hub: str, found: _Found) -> Arrangement:
    several = bool(hosts.masters or found.multimaster)
    if hosts.machines and not hub and not several and len(hosts.entries) > 1:
        mode = Fact(Mode.CENTRAL.value, None, _ONE_MASTER)
        return Arrangement(
            {"mode": mode, "hub": Blank(next(iter(hosts.entries)), "where roslaunch is started")}
        )
    busy = {str(one.value("host")) for one in found.programs.values() if one.value("host")}
    return arrangement(list(hosts.entries), _masters(hosts, hub), busy, found.multimaster)


def _nodes(launched: Mapping[str, Launched]) -> Iterator[tuple[str, Node]]:
    """Every node once, with the launch file that starts it."""
    seen: set[tuple[str | None, str | None, Place]] = set()
    for path, one in launched.items():
        for node in one.nodes:
            key = (node.name, node.machine, node.place)
            if key not in seen:
                seen.add(key)
                settings = tuple(replace(one, place=_normal(one.place)) for one in node.parameters)
                yield path, replace(node, place=_normal(node.place), parameters=settings)


def _why_not(node: Node) -> str:
    if not node.certain:
        return "the host only knows whether this node starts"
    if node.package is None or node.executable is None or node.name is None or node.machine is None:
        return "the host only knows the package, executable, name or machine of this node"
    if not is_allowed("package", node.package) or not is_allowed("executable", node.executable):
        return "its package or executable is not a name"
    return ""


def _host_of(node: Node, path: str, hosts: LabHosts, hub: str) -> Field:
    if node.machine:
        host = hosts.machines.get(node.machine)
        if host:
            return Fact(host, node.place)
        return Blank(
            next(iter(hosts.entries), "k3-pi"), f"no <machine> is called {node.machine} ({node.place})"
        )
    if hosts.default:
        return Fact(hosts.default, node.place)
    return hosts.of_file(path, hub)


def _add_robot(found: _Found, node: Node, host: Field, kind: str, types: Mapping[str, RobotType]) -> None:
    namespace, _, last = (node.name or "").strip("/").rpartition("/")
    called = namespace.rpartition("/")[2] or _bare(last) or kind
    name = name_fact(called, "robot", node.place, found.robots)
    why = f"{node.package}/{node.executable} is named like a driver of this type"
    fields: dict[str, Field] = {"type": Fact(kind, node.place, why), "host": host}
    line = line_of(str(name.value), _name(host), types.get(kind), node.parameters)
    used = list(map(str, line.value.values())) if isinstance(line, Fact) else []
    if isinstance(line, Fact) and isinstance(host, Blank):
        line = replace(line, guess=f"`{host.example}` stands for its host, which is to fill in")
    found.robots[str(name.value)] = Entry(name, fields, tuple(driver_notes(node, used)))
    found.lines.append(line)
    if namespace:
        is_new = namespace not in {one for _, one in found.namespaces}
        is_other = robot_namespace(str(name.value), None) != f"/{namespace}"
        if is_new and is_other and is_allowed("namespace", namespace):
            fields["namespace"] = Fact(namespace, node.place)
        found.namespaces[_name(host), namespace] = str(name.value)


def _name(host: Field) -> str:
    return str(host.value if isinstance(host, Fact) else host.example)


def _bare(name: str) -> str:
    for suffix in _SUFFIXES:
        name = name.removesuffix(suffix)
    return name


def _add_program(found: _Found, node: Node, host: Field) -> None:
    """Adds a program: in the namespace of a robot it is that robot's, on the robot's host or on another."""
    namespace = (node.name or "").strip("/").rpartition("/")[0]
    robots = {robot for (_, one), robot in found.namespaces.items() if one == namespace}
    here = found.namespaces.get((_name(host), namespace), "")
    robot = here or (min(robots) if len(robots) == 1 else "")
    where: dict[str, Field] = {"robot": Fact(robot, node.place)} if robot else {}
    if not here:
        where["host"] = host
    entry = program_of(node, where, {*found.programs, *found.robots})
    found.programs[entry.key] = entry


def _with_adapters(hosts: Sequence[Entry], lines: Sequence[Field]) -> tuple[Entry, ...]:
    """Gives a Bluetooth adapter to the hosts of robots with a Bluetooth line."""
    speaking = {
        str(one.value["host"]) for one in lines if isinstance(one, Fact) and one.value["kind"] == "bluetooth"
    }
    adapter = Fact(["hci0"], None, "its first Bluetooth adapter")
    return tuple(
        replace(one, fields={**one.fields, "bluetooth": adapter}) if one.key in speaking else one
        for one in hosts
    )


def _unread(launched: Mapping[str, Launched]) -> Iterator[Unread]:
    for path, one in launched.items():
        if not one.files and not one.faults:
            yield Unread(Place(path, 0), "it, or all launch files together, are too large")
        for place in one.unfound:
            yield Unread(_normal(place), "the included file is not here")
        for fault in one.faults:
            if fault.kind in (Refusal.MISSING, Refusal.BROKEN, Refusal.SKIPPED):
                yield Unread(_normal(fault.place), _text(fault))


def _text(fault: Fault) -> str:
    if fault.kind is Refusal.MISSING:
        return f"the argument `{fault.subject}` is given when it is launched"
    return fault.text


def _normal(place: Place) -> Place:
    return Place(posixpath.normpath(place.file), place.line)
