"""Reads the files of a lab, within the limits on files of a spec; the ROS variables in its scripts."""

from __future__ import annotations

import posixpath
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import urlsplit

from swarmctl.diagnostics import Diagnostic
from swarmctl.importing.draft import Value
from swarmctl.importing.unknown_values import is_secret
from swarmctl.ros_packages.launch_files import Place
from swarmctl.ros_packages.package import NO_PACKAGES, Packages
from swarmctl.spec.package_search import BUILT, packages_in
from swarmctl.swarm.addresses import ip_of
from swarmctl.yamltext.files import LoadBudget
from swarmctl.yamltext.project_files import ProjectFiles

LAUNCH = (".launch", ".launch.xml")
PYTHON = ".py"  # of which those are read that return a launch description
SCRIPTS = (".bash", ".sh", ".zsh", ".env")
YAML = (".yaml", ".yml", ".json")
VARIABLES = ("group_vars", "host_vars")
_SUFFIXES = (*LAUNCH, PYTHON, *SCRIPTS, *YAML, ".ini")
_PLAIN_NAMES = ("hosts", "inventory", "env", "setup", "bashrc", "environment")  # without a suffix
_MAX_FILE = 256 << 10
_MAX_FOLDERS = 500
_MAX_DEPTH = 6
_ANY = ("",)  # every name ends with it


@dataclass(frozen=True)
class LabFolder:
    """The texts of a folder by their path in it; ``named`` is the one file that is meant, if it is one."""

    texts: Mapping[str, str]
    named: str
    unread: list[str]  # files, and why they cannot be read
    packages: Packages

    def candidates(self) -> tuple[str, ...]:
        """The paths that may be imported: the named file alone, or all."""
        return (self.named,) if self.named else tuple(self.texts)


def lab_folder(path: Path) -> LabFolder | Diagnostic:
    """Returns what lies in a folder, or one file with what belongs to it, or why it cannot be read."""
    texts: dict[str, str] = {}
    unread: list[str] = []
    if path.is_dir():
        folder, named, packages = path, "", packages_in(((path, ""),))
        files = ProjectFiles.beside(path / "any", LoadBudget())
        paths = _below(files, folder)
    else:
        folder, named, packages = path.parent, path.name, NO_PACKAGES
        files = ProjectFiles.beside(path, LoadBudget())
        text = files.named(path)
        if isinstance(text, Diagnostic):
            return text
        texts[named], paths = text, _beside(files, path)
    for relative in paths:
        if files.exhausted:
            unread.append(f"{relative}: it, and what follows, are too many files or too large")
            break
        found = texts[named] if relative == named else _text(files, folder / relative)
        if isinstance(found, Diagnostic):
            line = found.span.line if found.span else 0
            unread.append(f"{Place(relative, line)}: {found.message}")
        else:
            texts[relative] = found
    return LabFolder(texts, named, unread, packages)


def _text(files: ProjectFiles, path: Path) -> str | Diagnostic:
    if not path.is_symlink() and path.is_file() and path.stat().st_size > _MAX_FILE:
        return Diagnostic("FILE002", f"it is larger than {_MAX_FILE >> 10} KiB")
    return files.text(path, _ANY)


def _beside(files: ProjectFiles, path: Path) -> Iterator[str]:
    """The files that belong to one file: variables of an inventory, launch files in its folder."""
    launch = (*LAUNCH, PYTHON)
    if path.name.endswith(launch):
        yield from (name for name in files.names(path.parent) if name.endswith(launch))
    for folder in VARIABLES:
        yield from _below(files, path.parent, folder)


def _below(files: ProjectFiles, root: Path, inside: str = "") -> Iterator[str]:
    """The files that may be read in the folder ``inside`` of another one and in those below it."""
    waiting = [inside]
    for _ in range(_MAX_FOLDERS):
        if not waiting:
            return
        inside = waiting.pop(0)
        for name in files.names(root / inside):
            path = posixpath.join(inside, name)
            if not (root / path).is_dir():
                if _may_be_read(path):
                    yield path
            elif not (root / path).is_symlink() and name not in BUILT and path.count("/") < _MAX_DEPTH:
                waiting.append(path)


def _may_be_read(path: str) -> bool:
    name = posixpath.basename(path)
    if is_of_variables(path):
        return not name.endswith(("~", ".bak", ".orig", ".retry"))
    if name.endswith(PYTHON):
        return "launch" in path
    return name.endswith(_SUFFIXES) or ("." not in name and name.startswith(_PLAIN_NAMES))


def is_of_variables(path: str) -> bool:
    """Returns True for a file of variables of an inventory."""
    return any(part in VARIABLES for part in posixpath.dirname(path).split("/"))


_VARIABLES = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")
#: The variables by which nodes of ROS 2 find each other.
OF_ROS_2 = (
    "ROS_DOMAIN_ID", "RMW_IMPLEMENTATION", "ROS_DISCOVERY_SERVER", "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY", "CYCLONEDDS_URI", "FASTRTPS_DEFAULT_PROFILES_FILE",
    "ZENOH_SESSION_CONFIG_URI", "ZENOH_ROUTER_CONFIG_URI",
)  # fmt: skip
_BEFORE = {"export", "then", "else", "do", "{"}  # words before an assignment
_ASSIGNMENT = re.compile(r"(\w+)=(.*)", re.DOTALL)
_COMPUTED = re.compile(r"[$`{}*\\]")


def is_env_file(text: str, variables: Sequence[str] = _VARIABLES) -> bool:
    """Returns True if a script sets a variable that says which master or address ROS uses."""
    return any(any(_assignments(line, variables)) for line in text.splitlines())


def env_of(
    path: str, text: str, variables: Sequence[str] = _VARIABLES
) -> tuple[Mapping[str, Value], list[str]]:
    """Returns the ROS variables of a script, and why others are not known."""
    found: dict[str, Value] = {}
    unread: dict[str, str] = {}
    for number, line in enumerate(text.split("\n"), 1):
        for name, value in _assignments(line, variables):
            place, before = Place(path, number), found.pop(name, None)
            if _COMPUTED.search(value):
                unread[name] = f"{place}: {name} is computed by the shell"
            elif name in unread or (before is not None and before.value != value):
                unread[name] = f"{place}: {name} is set more than once in this file"
            elif value:
                found[name] = Value(value, place)
    return found, list(unread.values())


def _assignments(line: str, variables: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The ROS variables that a line sets, alone or with others: not those of an `echo`."""
    if not any(name in line for name in variables):
        return
    words = shlex.shlex(line, posix=True, punctuation_chars=";&|")
    words.whitespace_split = True
    is_start = True
    try:
        for word in words:
            assignment = _ASSIGNMENT.fullmatch(word) if is_start else None
            if assignment and assignment[1] in variables:
                yield assignment[1], assignment[2]
            is_start = bool(assignment) or word in _BEFORE or not word.strip(";&|")
    except ValueError:  # a quote that another line closes
        return


ROS_PORT = 11311


def own_address(value: Value) -> Value:
    """Returns a ROS_IP or ROS_HOSTNAME as a name or an address, also of one that is a URL or has a port."""
    text = str(value.value)
    if ip_of(text) or not set(text) & {":", "/"}:
        return value
    host, _ = _server_of(text)
    return _corrected(value, host, host) if host else value


def master_of(uri: Value) -> tuple[Value, int]:
    """Returns the host and the port of a ROS_MASTER_URI, also a wrong one; no host for what is none."""
    text = str(uri.value)
    host, port = _server_of(text)
    needed = f"http://{f'[{host}]' if ':' in host else host}:{port or ROS_PORT}"
    is_right = not host or text.lower().removesuffix("/") == needed
    found = replace(uri, value=host) if is_right else _corrected(uri, host, needed)
    return found, port or ROS_PORT


def _corrected(value: Value, address: str, needed: str) -> Value:
    text = str(value.value)
    return replace(value, value=address, was="" if is_secret("", text) else text, needed=needed)


def _server_of(text: str) -> tuple[str, int | None]:
    """The host and the port of a URL, also of one without a scheme; no host for what is none."""
    try:
        parts = urlsplit(text if "://" in text else f"http://{text}")
        return parts.hostname or "", parts.port
    except ValueError:
        return "", None
