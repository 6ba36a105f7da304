"""Drafts a spec of ROS 2 from launch files in Python, XML and YAML, and from scripts with its variables."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from swarmctl.importing.crazyflies import add_all_crazyflies
from swarmctl.importing.dds_profiles import Setting, rmw_of, settings_of
from swarmctl.importing.draft import Draft, Value
from swarmctl.importing.lab_draft import Lab
from swarmctl.importing.lab_folder import LAUNCH, PYTHON, YAML, LabFolder, is_launch_xml
from swarmctl.importing.lab_hosts import LabHosts, add_islands, address_of, domain_of
from swarmctl.importing.lab_scripts import OF_ROS_1, Ros, Started
from swarmctl.importing.launched_files import found_in, unread, whole_folder
from swarmctl.importing.recognition import driver_files
from swarmctl.importing.unknown_values import is_secret
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.ros_packages import python_launch, xml_launch
from swarmctl.ros_packages.launch_description import evaluate
from swarmctl.ros_packages.launch_files import Launched, Place
from swarmctl.ros_packages.launch_values import Reader
from swarmctl.ros_packages.package import Package
from swarmctl.swarm.addresses import ip_of, means_self

_READERS: Mapping[str, Reader] = {
    PYTHON: python_launch.read,
    **dict.fromkeys(LAUNCH, xml_launch.read_xml),
    **dict.fromkeys((".yaml", ".yml"), xml_launch.read_yaml),
}
_SOURCED = re.compile(
    r"(?:/opt/ros/|^\s*(?:image:|FROM |(?:ARG|ENV) ROS_DISTRO[= ]).*[:/_ =-])"
    r"(humble|jazzy|kilted|lyrical|rolling|iron|foxy|galactic)\b"
)
_QUOTED = re.compile(r"\s*(#|echo\b|printf\b)")
_NAMED = re.compile(
    r"\bros\W{0,3}2?\W{0,3}(humble|jazzy|kilted|lyrical|rolling|iron|foxy|galactic)\b", re.IGNORECASE
)
DISTROS = ("humble", "jazzy", "kilted", "lyrical")
NEWEST_LTS = "jazzy"
RMW = {"rmw_fastrtps_cpp": "fastrtps", "rmw_cyclonedds_cpp": "cyclonedds", "rmw_zenoh_cpp": "zenoh"}
_KEYS = {
    "ROS_DOMAIN_ID": "domain", "RMW_IMPLEMENTATION": "rmw", "ROS_DISCOVERY_SERVER": "servers",
    "ROS_STATIC_PEERS": "discovery", "ROS_AUTOMATIC_DISCOVERY_RANGE": "discovery",
    "ROS_LOCALHOST_ONLY": "discovery",
}  # fmt: skip
_SERVER_PORT = 11811
_FILE_VARIABLES = ("CYCLONEDDS_URI", "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
_SERVER = re.compile(r"(?:UDPv4:)?\[?([\w.-]+)\]?(?::(\d{1,5}))?")


def is_ros_2_launch(path: str, text: str) -> bool:
    """Returns True for a launch file that ROS 2 reads."""
    if path.endswith(PYTHON):
        return "generate_launch_description" in text
    if is_launch_xml(path):
        return "<launch" in text and xml_launch.is_of_ros_2(path, text)
    return path.endswith(YAML) and "launch" in posixpath.basename(path) and "\nlaunch:" in f"\n{text}"


def draft_from_ros_2(
    folder: LabFolder, types: Mapping[str, AnyRobotType], draft: Draft | None = None
) -> Draft:
    """Returns the draft from the launch files and scripts of a folder; ``types`` are the robot types.

    ``draft`` has what an inventory says, if there is one.
    """

    _, packages = whole_folder(folder)
    closed = driver_files(packages, types)

    def is_launch(path: str) -> bool:
        return is_ros_2_launch(path, folder.texts[path])

    def evaluated(
        package: Package, path: str, given: Mapping[str, str | None], _namespace: str, limit: int
    ) -> Launched:  # the namespace is a variable of ROS 1
        return evaluate(package, path, packages, _READERS, limit=limit, arguments=given, closed=closed)

    found = found_in(folder, Ros.TWO, types, is_launch, evaluated)
    started, launched = found.started, found.launched
    lab = Lab(types, found, draft or Draft("launch files and scripts of ROS 2"))
    lab.add_scripts(started)
    domains = _domains(started, lab.started_on)
    variables = dict(_variables(started, lab.draft.unread, domains))
    ros = _Ros(lab.draft, lab.hosts, variables)
    ros.add_profiles(folder)
    ros.add_servers(started, lab.started_on)
    ros.add_peers()
    if found.starts_nodes:
        lab.add_any_host("it starts all nodes")
    elif variables or _profiles(folder):
        lab.add_any_host("the files are for it")
    lab.add_nodes(launched)
    lab.add_services(found.services, variables)
    lab.add_parameters(launched)
    add_all_crazyflies(lab.draft, lab.hosts, folder)
    lab.draft.unread += (*lab.unknown.unread(), *unread(launched))
    if lab.draft.hosts:
        distro = _distro(folder)
        lab.draft.files |= {distro.place.file} if distro.place else set()
        value = ros.value(distro)
        if (simulated := lab.draft.last.pop("ros", None)) is not None:
            value = replace(
                value, value={**value.value, **simulated.value}, place=value.place or simulated.place
            )
        if (known := lab.draft.first.get("ros")) is not None:  # what an inventory says wins
            named = not known.guess or bool(value.guess)
            own = {key: one for key, one in known.value.items() if key != "distro" or named}
            differs = value.value["distro"] != own.get("distro") and "README" in value.guess
            known = replace(known, guess=f"{known.guess}; {value.guess}" if differs else known.guess)
            value = replace(known, value={**value.value, **own}, guess=known.guess if named else value.guess)
        lab.draft.first = {**(lab.draft.first or mode_of(lab.draft)), "ros": value}
    if len(domains) > 1:
        hosts = {number: [host for host, _ in found] for number, found in domains.items()}
        add_islands(lab.draft, hosts, {number: found[0][1] for number, found in domains.items()})
    return lab.draft


def _domains(
    started: Sequence[Started], hosts: Mapping[str, Value]
) -> Mapping[int, Sequence[tuple[str, Value]]]:
    """The hosts that scripts start nodes on with each ROS_DOMAIN_ID, with where it stands."""
    found: dict[int, dict[str, Value]] = {}
    for one in started:
        domain = one.variables.get("ROS_DOMAIN_ID")
        number = domain_of(str(domain.value)) if domain and one.remote else None
        if domain and number is not None:
            found.setdefault(number, {}).setdefault(str(hosts[one.key].value), domain)
    return {number: [*of.items()] for number, of in sorted(found.items())}


def mode_of(draft: Draft) -> Mapping[str, Value]:
    """Returns the mode of hosts that share a graph without a master."""
    first = next(iter(draft.hosts))
    if len(draft.hosts) == 1:
        return {
            "mode": Value("single-minded", guess="there is one host"),
            "leader": Value(first, guess="it is the only host"),
        }
    return {
        "mode": Value("central", guess="nodes of ROS 2 share a graph, and each robot has its own mind"),
        "hub": Value(first, guess="it is the first host"),
    }


def _variables(
    started: Sequence[Started], unread: list[str], domains: Mapping[int, Sequence[tuple[str, Value]]]
) -> Iterator[tuple[str, Value]]:
    """The variables of all scripts; one that two scripts have with different values is the first one's.

    Of several ``domains``, which are islands, the first one is that of the swarm.
    """
    found: dict[str, Value] = {}
    if len(domains) > 1:
        found["ROS_DOMAIN_ID"] = next(iter(domains.values()))[0][1]
    starting = [one for one in started if one.launched.nodes or one.launched.includes]
    for one in started:
        for name, value in one.variables.items():
            if name in OF_ROS_1 or (name == "ROS_DOMAIN_ID" and one.remote and len(domains) > 1):
                continue
            without = [two.path for two in starting if one in starting and name not in two.variables]
            why = f"{without[0]} starts nodes without it" if without else ""
            if one.runs_others and one not in starting:
                why = f"{one.path} sets it for what it runs"
            before = found.setdefault(name, replace(value, guess=why))
            if before.value != value.value:
                unread.append(f"{value.place}: {name} has another value than in {before.place}")
    yield from found.items()


def _profiles(folder: LabFolder) -> Sequence[str]:
    return [path for path in folder.candidates() if path.endswith(".xml") and rmw_of(folder.texts[path])]


def _distro(folder: LabFolder) -> Value:
    """The distribution whose setup a file sources; a guess if none does."""
    readme = next((path for path in folder.texts if path.startswith("README.")), "")
    for path, text in folder.texts.items():
        for number, line in enumerate(text.split("\n"), 1):
            if path == readme or (match := _SOURCED.search(line)) is None or _QUOTED.match(line):
                continue
            if match[1] in DISTROS:
                return Value(match[1], Place(path, number))
            why = f"{path}:{number} has {match[1]}, which swarmctl does not know"
            return Value(NEWEST_LTS, guess=why)
    named = _NAMED.search(folder.texts.get(readme, ""))
    if named and named[1].lower() in DISTROS:
        return Value(named[1].lower(), guess=f"{readme} is about {named[1]}")
    why = f", and {readme} is about {named[1]}, which swarmctl does not know" if named else ""
    return Value(NEWEST_LTS, guess=f"no file names the distribution{why}")


class _Ros:
    """The key `ros` of a draft, from the variables of scripts."""

    def __init__(self, draft: Draft, hosts: LabHosts, variables: Mapping[str, Value]) -> None:
        self._draft, self._hosts, self._variables = draft, hosts, dict(variables)
        self._servers: list[str] = []
        self._peers: list[str] = []
        self._files: dict[str, str] = {}  # of DDS, each with its rmw

    def add_profiles(self, folder: LabFolder) -> None:
        """Adds what files of Cyclone DDS and Fast DDS set, and what a variable has instead of a file."""
        texts = {path: folder.texts[path] for path in _profiles(folder)}
        inline = self._variables.get("CYCLONEDDS_URI", Value(""))
        if str(inline.value).lstrip().startswith("<"):
            texts[str(inline.place)] = str(self._variables.pop("CYCLONEDDS_URI").value)
        for path, text in texts.items():
            self._files[path] = rmw_of(text)
            for one in settings_of(path, text):
                self._add_setting(one)

    def _add_setting(self, one: Setting) -> None:
        names = {"domain": "ROS_DOMAIN_ID", "peer": "ROS_STATIC_PEERS", "server": "ROS_DISCOVERY_SERVER"}
        before = self._variables.get(names.get(one.role, ""))
        given = Value(one.value, one.place)
        if one.role in ("peer", "server"):
            many = f"{before.value};{one.value}" if before else one.value
            is_new = before is None or one.value not in str(before.value)
            given = replace(before or given, value=many if is_new or before is None else before.value)
        if one.role and (one.role != "domain" or before is None):
            self._variables[names[one.role]] = given
        elif before is None or before.value != one.value:
            self._draft.unread.append(f"{one.place}: {one.path} = {one.value[:60]} has no key in a spec")

    def add_servers(self, started: Sequence[Started], hosts: Mapping[str, Value]) -> None:
        """Adds the hosts of discovery servers, in the order of their numbers; ``hosts`` start some."""
        found: dict[int, str] = {}
        for script in started:
            for number, place in script.servers.items():
                if script.key in hosts:
                    found.setdefault(number, str(hosts[script.key].value))
                else:
                    self._draft.unread.append(f"{place}: a server of discovery; add its host to `servers`")
        given = self._variables.get("ROS_DISCOVERY_SERVER", Value(""))
        places = str(given.value).rstrip("; ").split(";") if given.value else []
        for number, one in enumerate(places):
            match = _SERVER.fullmatch(one.strip())
            if not one.strip():
                why = "is empty: the servers of a spec have the numbers 0, 1, 2, ... in its order"
                self._draft.unread.append(f"{given.place}: place {number} of ROS_DISCOVERY_SERVER {why}")
            elif match is None:
                self._draft.unread.append(f"{given.place}: `{one}` is no discovery server")
            else:
                if int(match[2] or _SERVER_PORT) != _SERVER_PORT:
                    self._draft.unread.append(
                        f"{given.place}: port {match[2]}; swarmctl takes {_SERVER_PORT}"
                    )
                why = "it runs a discovery server"
                found[number] = self._host(match[1], f"server-{len(found) + 1}", given, why)
        self._servers = list(dict.fromkeys(found[number] for number in sorted(found)))

    def add_peers(self) -> None:
        """Adds the hosts that nodes look for."""
        given = self._variables.get("ROS_STATIC_PEERS", Value(""))
        for one in str(given.value).split(";"):
            if means_self(one.strip()):
                self._draft.unread.append(f"{given.place}: `{one.strip()}` is the computer itself")
            elif _SERVER.fullmatch(one.strip()):
                self._host(one.strip(), f"peer-{len(self._peers) + 1}", given, "nodes look for it")
                self._peers.append(one.strip())
            elif one.strip():
                self._draft.unread.append(f"{given.place}: `{one}` is no address of a host")

    def _host(self, address: str, name: str, given: Value, why: str) -> str:
        """The host with an address, a new one if it is not known."""
        known = self._hosts.find(address)
        fields = {"address": address_of(address, given.place or Place("", 0))}
        return known or self._hosts.new(name if ip_of(address) else address, given.place, fields, why)

    def _keys(self, name: str, text: str) -> Mapping[str, Any] | None:
        """What a variable is in a spec, but for servers and peers, which are hosts; None if it has no key."""
        if name == "ROS_DOMAIN_ID" and domain_of(text) is not None:
            return {"domain": domain_of(text)}
        if name == "RMW_IMPLEMENTATION" and text in RMW:
            return {"rmw": RMW[text]}
        if (name == "ROS_DISCOVERY_SERVER" and self._servers) or (name == "ROS_STATIC_PEERS" and self._peers):
            return {}
        if name == "ROS_AUTOMATIC_DISCOVERY_RANGE" and text in ("LOCALHOST", "SUBNET"):
            return {"discovery": "local" if text == "LOCALHOST" else "multicast"}
        return {"discovery": "local"} if (name, text) == ("ROS_LOCALHOST_ONLY", "1") else None

    def value(self, distro: Value) -> Value:
        """Returns the key `ros`, and lists what it does not have."""
        ros: dict[str, Any] = {"distro": distro.value}
        place, left = distro.place, self._draft.unread
        places: dict[str, Place] = {}
        guesses = [distro.guess] if distro.guess else []
        for name, one in self._variables.items():
            text = str(one.value)
            if name in _FILE_VARIABLES and any(
                text.endswith(posixpath.basename(path)) for path in self._files
            ):
                left.append(f"{one.place}: {name} is {text}, of which what has a key is kept")
                continue
            if name == "ROS_STATIC_PEERS" and not self._peers:
                continue  # each of them is listed
            keys = self._keys(name, text)
            if keys is None:
                secret = is_secret(name, text)
                shown = "may have a secret" if secret else f"is {text}, which has no key in a spec"
                left.append(f"{one.place}: {name} {shown}")
                continue
            ros |= keys
            if one.place is not None:
                places[_KEYS[name]] = one.place
            guesses += [f"{_KEYS[name]}: {one.guess}"] if one.guess else []
            place = place or one.place
        if self._servers:
            ros["servers"] = self._servers
        if (self._servers or self._peers) and "discovery" in ros:
            kept = "servers" if self._servers else "peers"
            left.append(f"discovery: the {kept} are kept, and not the range of discovery")
            del ros["discovery"]
        if self._peers and not self._servers and ros.get("rmw") != "zenoh":
            ros["discovery"] = "peers"
        if "cyclonedds" in self._files.values() and "rmw" not in ros:
            left.append("rmw: a file of Cyclone DDS is here, and nothing sets RMW_IMPLEMENTATION")
        where = {key: places[key] for key in ros if key in places}
        return replace(distro, value=ros, place=place, places=where, guess="; ".join(guesses))
