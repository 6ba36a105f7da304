"""Drafts a spec from an Ansible inventory and the variables beside it."""

from __future__ import annotations

import json
import os
import posixpath
import re
import resource
import subprocess
import tempfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx
import yaml

from swarmctl.importing.draft import Draft, Entry, Value
from swarmctl.importing.lab_folder import SCRIPTS, VARIABLES, LabFolder, is_of_variables
from swarmctl.importing.lab_hosts import (
    EXAMPLE,
    LARGEST_DOMAIN,
    LabHosts,
    add_islands,
    address_of,
    domain_of,
    number,
)
from swarmctl.importing.recognition import type_of_group, unknown_line
from swarmctl.importing.ros2_lab import DISTROS, NEWEST_LTS, RMW, mode_of
from swarmctl.importing.unknown_values import is_secret
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.ros_packages.launch_files import Place
from swarmctl.suggest import did_you_mean
from swarmctl.swarm.addresses import means_self
from swarmctl.swarm.names import robot_namespace, valid_name
from swarmctl.yamltext.compose import pairs_of

_MEMORY = 1 << 30  # bytes
_TIMEOUT = 60.0  # s
_VAULT_FILE = "$ANSIBLE_VAULT;"  # how a file begins that ansible-vault encrypts
_PARTS = {"hosts", "children", "vars"}
_SECTION = re.compile(r"\[([^\[\]]+)\]")
_HOST = re.compile(r"[^\s=]+(?:\s+\w+=.*)?")


class InventoryError(Exception):
    """An inventory that cannot be read. The first argument is the problem, the others are what to do."""


Variables = Mapping[str, str | None]
"""The values of variables as text: empty if it is not a scalar, None if ansible-vault encrypts it."""


@dataclass(frozen=True)
class Inventory:
    """The variables of each host, with those of its groups, and its groups, from general to specific ones."""

    hosts: Mapping[str, Variables]
    groups: Mapping[str, tuple[str, ...]]
    encrypted: list[str]  # files of variables


def is_yaml_inventory(root: yaml.Node | None) -> bool:
    """Returns True if all keys at the top of a YAML file are groups, one with hosts or children."""
    groups = [pairs_of(value).keys() for _, value in pairs_of(root).values()]
    return any({"hosts", "children"} & one for one in groups) and all(one <= _PARTS for one in groups)


def is_ini_inventory(path: str, text: str) -> bool:
    """Returns True for a file with `ansible_` variables, or with nothing but hosts and groups of hosts."""
    if text.startswith("#!") or path.endswith(SCRIPTS):
        return False
    if "ansible_" in text:
        return True
    written = [line.strip() for line in text.split("\n")]
    lines, section = [line for line in written if line and line[0] not in "#;"], ""
    for line in lines:
        if match := _SECTION.match(line):
            section = match[1]
        elif not section.endswith(":vars") and not _HOST.fullmatch(line):
            return False
    return bool(section or (lines and posixpath.basename(path).startswith(("inventory", "hosts"))))


def inventory(texts: Mapping[str, str], path: str) -> Inventory:
    """Returns the inventory of a file in ``texts``, with variables of the files beside it.

    Raises ``InventoryError``. Ansible reads copies of these files alone, in a folder of their own.
    """
    beside = posixpath.dirname(path)
    paths = [one for one in texts if posixpath.relpath(one, beside or ".").split("/")[0] in VARIABLES]
    encrypted = [one for one in paths if texts[one].startswith(_VAULT_FILE)]
    try:
        with tempfile.TemporaryDirectory() as folder:
            for one in {path, *paths} - {*encrypted}:
                place = Path(folder, "lab", posixpath.relpath(one, beside or "."))
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_text(texts[one], "utf-8", "surrogateescape")
            found = _listed(Path(folder), posixpath.basename(path), path)
    except OSError as error:
        raise InventoryError(
            f"{path} cannot be copied for ansible-inventory: {error.strerror}",
            f"free space in {tempfile.gettempdir()}, or set TMPDIR",
        ) from error
    hosts: Mapping[str, Mapping[str, Any]] = found.pop("_meta", {}).get("hostvars", {})
    groups = _memberships(found)
    variables = {name: {key: _text(one) for key, one in hosts.get(name, {}).items()} for name in groups}
    return Inventory(variables, groups, encrypted)


def _listed(folder: Path, name: str, path: str) -> dict[str, Any]:
    """What ``ansible-inventory`` prints; its messages are not shown, as they may quote a secret."""
    env = {key: one for key, one in os.environ.items() if not key.startswith("ANSIBLE_")}
    env |= {
        "ANSIBLE_CONFIG": str(folder / "ansible.cfg"),
        "ANSIBLE_HOME": str(folder),
        "ANSIBLE_LOCAL_TEMP": str(folder),
        "ANSIBLE_INVENTORY_ENABLED": "ini,yaml",
        "ANSIBLE_INVENTORY_ANY_UNPARSED_IS_FAILED": "true",
        "ANSIBLE_INVENTORY_UNPARSED_FAILED": "true",
    }
    (folder / "ansible.cfg").touch()
    try:
        done = subprocess.run(
            ["ansible-inventory", "--list", "-i", f"lab/{name}"],
            cwd=folder, env=env, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIMEOUT, check=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY)),
        )  # fmt: skip
        return dict(json.loads(done.stdout))
    except FileNotFoundError as error:
        raise InventoryError(
            f"reading the Ansible inventory {path} needs the program ansible-inventory",
            "install ansible-core: `apt install ansible-core` or `pip install ansible-core`",
        ) from error
    except (subprocess.SubprocessError, OSError, ValueError, RecursionError) as error:
        raise InventoryError(
            f"ansible-inventory cannot read {path}", f"`ansible-inventory --list -i {path}` shows why"
        ) from error


def _memberships(groups: Mapping[str, Mapping[str, Any]]) -> dict[str, tuple[str, ...]]:
    """The groups of each host; a group comes behind those that it is a child of."""
    below: networkx.DiGraph[str] = networkx.DiGraph()
    for name, one in groups.items():
        below.add_edges_from((name, child) for child in one.get("children", ()))
    found: dict[str, tuple[str, ...]] = {}
    order = list(networkx.topological_sort(below))
    for name in order:
        inside = {name, *networkx.descendants(below, name)}
        for host in (host for one in order if one in inside for host in groups.get(one, {}).get("hosts", ())):
            found[host] = tuple(dict.fromkeys((*found.get(host, ()), name)))
    return found


def _text(value: Any) -> str | None:
    if isinstance(value, dict) and "__ansible_vault" in value:
        return None
    if isinstance(value, dict) and "__ansible_unsafe" in value:
        value = value["__ansible_unsafe"]
    return "" if isinstance(value, dict | list) else str(value)


_COMPUTED = re.compile(r"\{[{%#]")  # of Jinja
# Keys of a host, an example of each, and the variables that have them; the first that is set counts.
_HOST_KEYS: Mapping[str, tuple[object, tuple[str, ...]]] = {
    "address": (EXAMPLE, ("ansible_host", "ansible_ssh_host")),
    "user": ("robot", ("ansible_user", "ansible_ssh_user")),
    "port": (22, ("ansible_port", "ansible_ssh_port")),
}
_OF_HOSTS = {one for _, names in _HOST_KEYS.values() for one in names}
_MASTER = ("ros_master_uri", "ROS_MASTER_URI")
_DISTRO, _DOMAIN = ("ros_distro", "ROS_DISTRO"), ("ros_domain_id", "ROS_DOMAIN_ID")
_RMW = ("rmw_implementation", "RMW_IMPLEMENTATION")
_NAMESPACE = ("robot_namespace", "ros_namespace")
_OTHERS = {"ansible_connection", "robot_type", *_MASTER, *_DISTRO, *_DOMAIN, *_RMW, *_NAMESPACE}
_SSH = {"ssh", "smart", "paramiko", "paramiko_ssh"}
_OF_SSH = re.compile(r"ansible_(ssh_)?private_key_file|ansible_ssh_\w*args")


def draft_from_inventory(folder: LabFolder, path: str, types: Mapping[str, AnyRobotType]) -> Draft:
    """Returns the draft from the inventory file at ``path`` of a folder; ``types`` are the robot types.

    Raises ``InventoryError``.
    """
    found, place = inventory(folder.texts, path), Place(path, 0)
    places = _Places(folder.texts, path, found.groups)
    draft = Draft(f"the Ansible inventory {path}")
    hosts = LabHosts(draft)
    names: dict[str, str] = {}  # in the spec, by those in the inventory
    for name, variables in found.hosts.items():
        if why := _no_host(name, variables):
            draft.unread.append(f"{path}: host `{name}`: {why}")
        else:
            names[name] = hosts.new(name, place, _fields(name, variables, places))
    for name, key in names.items():
        uri = _first(found.hosts[name], _MASTER)
        if uri and not _COMPUTED.search(uri):
            hosts.add_master([key], Value(uri, places.of(*_MASTER)))
        _add_robot(draft, (name, key), found, types, place)
    _add_ros(draft, {key: found.hosts[name] for name, key in names.items()}, places)
    groups: dict[str, list[str]] = {}
    for name, key in names.items():
        for group in found.groups[name]:
            if group not in ("all", "ungrouped"):
                groups.setdefault(valid_name(group, "group"), []).append(key)
    if groups:
        draft.last["groups"] = Value(groups, place)
    draft.files |= {*places.files}
    draft.unread += [f"{one}: the whole file is encrypted by ansible-vault" for one in found.encrypted]
    draft.unread += _left_out({name: found.hosts[name] for name in names}, places)
    return draft


class _Places:
    """Where the variables of an inventory stand, as far as one file only has each."""

    def __init__(self, texts: Mapping[str, str], path: str, groups: Mapping[str, Sequence[str]]) -> None:
        """Takes the inventory at ``path``, and the files of variables of hosts and their ``groups``."""
        self.path, self._groups = path, groups
        owners = {*groups, *(one for of in groups.values() for one in of), "all"}
        self.files = {path, *(one for one in texts if is_of_variables(one) and owners & {*_words(one)})}
        self._lines = [
            (Place(one, number), line)
            for one in sorted(self.files)
            for number, line in enumerate(texts[one].split("\n"), 1)
        ]

    def of(self, *names: str, host: str = "") -> Place:
        """Returns the line that sets one of these variables of a host; the inventory if several do."""
        pattern = re.compile(rf"(?<![\w-])({'|'.join(map(re.escape, names))})[\"']?\s*[:=]")
        found = [place for place, line in self._lines if pattern.search(line)]
        for owner in (host, *reversed(self._groups.get(host, ()))):  # the most specific one counts
            if own := [one for one in found if is_of_variables(one.file) and owner in _words(one.file)]:
                found = own
                break
        return found[0] if len(found) == 1 else Place(self.path, 0)


def _words(path: str) -> list[str]:
    """The folders of a path and the name of its file, without the suffix."""
    return posixpath.splitext(path)[0].split("/")


def _add_robot(
    draft: Draft, host: tuple[str, str], found: Inventory, types: Mapping[str, AnyRobotType], place: Place
) -> None:
    """Adds the robot that a host carries, if its variable or the name of a group says so."""
    name, key = host  # in the inventory, and in the spec
    variables = found.hosts[name]
    kind = _robot_type(variables, found.groups[name], types, place)
    if kind is None:
        if named := variables.get("robot_type"):
            meant = did_you_mean(named, types, "the types are")[0]
            draft.unread.append(f"{place}: robot_type `{named}` of host `{name}` is no type; {meant}")
        return
    fields = {"type": kind, "host": Value(key, place)}
    namespace = _first(variables, _NAMESPACE).strip("/")
    if namespace and robot_namespace(key, None) != f"/{namespace}":
        fields["namespace"] = Value(namespace, place)
    draft.robots[key] = Entry(Value(key, place, "one robot is driven by this host"), fields)
    if types[kind.value].link is not None:
        draft.lines.append(unknown_line(key, key, types[kind.value]))


def _add_ros(draft: Draft, hosts: Mapping[str, Variables], places: _Places) -> None:
    """Adds what variables of ROS 2 say: one distribution, and an island for each domain."""
    place = places.of(*_DISTRO)
    left, domains = draft.unread, dict[int, list[str]]()
    ros: dict[str, object] = {}
    for key, variables in hosts.items():
        distro, domain, rmw = (_first(variables, one) for one in (_DISTRO, _DOMAIN, _RMW))
        if distro in DISTROS and ros.setdefault("distro", distro) != distro:
            left.append(f"{place}: host `{key}` has {distro}, and others have {ros['distro']}")
        elif distro not in ("", "noetic", *DISTROS):
            left.append(f"{place}: ros_distro {distro} of host `{key}` is none that swarmctl knows")
        if rmw in RMW:
            ros.setdefault("rmw", RMW[rmw])
        elif rmw:
            left.append(f"{places.of(*_RMW)}: rmw_implementation {rmw} of host `{key}` has no key in a spec")
        if (known := domain_of(domain)) is not None:
            domains.setdefault(known, []).append(key)
        elif domain:
            why = f"of host `{key}` is none from 0 to {LARGEST_DOMAIN}"
            left.append(f"{places.of(*_DOMAIN)}: ros_domain_id {domain} {why}")
    if not (ros or domains) and any(_first(one, _DISTRO) == "noetic" for one in hosts.values()):
        draft.last["ros"] = Value({"distro": "noetic"}, place)
    if ros or domains:
        if domains:
            ros["domain"] = min(domains)
        guess = "" if "distro" in ros else "nothing names the distribution"
        own = {"domain": places.of(*_DOMAIN), "rmw": places.of(*_RMW)}
        own = {key: one for key, one in own.items() if key in ros}
        value = Value({"distro": NEWEST_LTS, **ros}, place, guess, places=own)
        draft.first = {**mode_of(draft), "ros": value}
    if len(domains) > 1:
        add_islands(draft, domains, dict.fromkeys(domains, Value("", places.of(*_DOMAIN))))


def _first(variables: Variables, names: Collection[str]) -> str:
    """The first variable that has a text."""
    return next((text for name in names if (text := variables.get(name))), "")


def _no_host(name: str, variables: Variables) -> str:
    """Says why swarmctl cannot log into a host by SSH; empty if it can."""
    connection = (variables.get("ansible_connection") or "ssh").rpartition(".")[2]
    own = _first(variables, _HOST_KEYS["address"][1]) or name
    if connection == "local" or means_self(own):
        this = "ansible_connection=local" if connection == "local" else own
        return f"`{this}` is the computer that runs Ansible; add it as a host if robots depend on it"
    return "" if connection in _SSH else f"it is reached by {connection}, and a host needs Linux and SSH"


def _fields(name: str, variables: Variables, places: _Places) -> Mapping[str, Value]:
    fields = {
        "address": address_of(name, Place(places.path, 0))
    }  # what Ansible connects to without another one
    for key, (example, names) in _HOST_KEYS.items():
        variable = next((one for one in names if one in variables), "")
        if variable:
            text = variables[variable]
            if why := _unusable(variable, text):
                fields[key] = Value(example, fill_in=f"{variable} {why}")
            else:
                fields[key] = Value(
                    number(text or "") if key == "port" else text, places.of(variable, host=name)
                )
    return fields


def _unusable(variable: str, text: str | None) -> str:
    """Says why the value of a variable is not taken; empty if it is."""
    if text is None:
        return "is encrypted"
    if is_secret(variable, text):
        return "may be a secret"
    return "is computed by a template" if _COMPUTED.search(text) else ""


def _left_out(hosts: Mapping[str, Variables], places: _Places) -> Sequence[str]:
    """Says which variables of hosts are not in the draft, and why."""
    found: dict[tuple[str, str], list[str]] = {}
    for name, variables in hosts.items():
        for variable, text in variables.items():
            why = _unusable(variable, text)
            if _OF_SSH.fullmatch(variable):
                why = "belongs in ~/.ssh/config; a jump host is `via`"
            elif variable not in _OF_HOSTS | _OTHERS:
                why = why or "has no key in a spec"
            elif variable in _OF_HOSTS:
                why = ""  # it is to fill in
            if why:
                found.setdefault((variable, why), []).append(name)
    return [
        f"{places.of(variable, host=names[0])}: {variable} of host `{names[0]}`"
        f"{f' and {len(names) - 1} more' if names[1:] else ''} {why}"
        for (variable, why), names in found.items()
    ]


def _robot_type(
    variables: Variables, groups: Sequence[str], types: Collection[str], place: Place
) -> Value | None:
    """The type of the robot that a host carries, if its variable or the name of a group says so."""
    named = variables.get("robot_type")
    if named in types:
        return Value(named, place)
    if named:
        return None
    found = next((kind for one in reversed(groups) if (kind := type_of_group(one, types))), "")
    return Value(found, place, "its host is in a group that is named like this type") if found else None
