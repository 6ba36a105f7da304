"""Reads the files of a lab, within the limits on files of a spec; the ROS variables in its scripts."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from urllib.parse import urlsplit

from swarmctl.diagnostics import Diagnostic
from swarmctl.importing.draft import Value
from swarmctl.importing.script_text import UNIT, is_image, script_text
from swarmctl.importing.shell_script import Script, read_script
from swarmctl.importing.tmux_sessions import is_session, script_of_session, without_erb
from swarmctl.importing.unknown_values import is_secret
from swarmctl.ros_packages.launch_files import Place
from swarmctl.ros_packages.package import NO_PACKAGES, Packages
from swarmctl.spec.package_search import BUILT, packages_in
from swarmctl.swarm.addresses import ip_of
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.files import LoadBudget
from swarmctl.yamltext.project_files import ProjectFiles

LAUNCH = (".launch", ".xml")
PYTHON = ".py"  # of which those are read that return a launch description
SCRIPTS = (".bash", ".sh", ".zsh", ".env")
YAML = (".yaml", ".yml", ".json")
VARIABLES = ("group_vars", "host_vars")
_SUFFIXES = (".launch", PYTHON, *SCRIPTS, *YAML, UNIT, ".ini")
_PLAIN_NAMES = ("hosts", "inventory", "env", "setup", "bashrc", "environment")  # without a suffix
_OF_DDS = re.compile("dds|rtps|cyclone|profile|discovery|peer|shm", re.IGNORECASE)
_SESSION = re.compile(r"^windows\s*:", re.MULTILINE)
_EXAMPLE = re.compile(r"(^|[._-])(example|sample|template|dist)([._-]|$)", re.IGNORECASE)
_RUNS = re.compile(r"\b(subprocess|os\.system|paramiko|fabric|pexpect)\b")
_STARTS = re.compile(
    r"\b(?!127|0)(?:\d{1,3}\.){3}\d{1,3}\b|\b(?:[0-9a-f]{2}:){5}[0-9a-f]{2}\b"
    r"|\b(paramiko|fabric|pexpect|ssh|ros2 (?:launch|run)|roslaunch|rosrun|ROS_DOMAIN_ID)\b"
)
_MAX_FILE = 256 << 10
_MAX_FOLDERS = 500
_MAX_DEPTH = 12
_MOST_OF_COMPOSE = 20  # files of variables
_ANY = ("",)  # every name ends with it


@dataclass(frozen=True)
class LabFolder:
    """The texts of a folder by their path in it; ``named`` is the one file that is meant, if it is one."""

    texts: Mapping[str, str]
    named: str
    unread: list[str]  # files, and why they cannot be read
    packages: Packages
    others: Sequence[str] = ()  # paths of files that no reader takes

    @cached_property
    def scripts(self) -> Mapping[str, Script]:
        """What each script of ROS does, but for those that another one runs."""
        texts = {path: script_text(path, text) for path, text in self.texts.items() if _is_script(path)}
        for path, text in self.texts.items():
            if path.endswith(YAML) and _SESSION.search(text):
                root, _ = compose(without_erb(text), path, LoadBudget())
                texts |= {path: script_of_session(root, text)} if is_session(root) else {}
        read = {path: read_script(path, texts) for path in self.candidates() if path in texts}
        run = {other for one in read.values() for other in one.others}
        return {path: one for path, one in read.items() if path not in run}

    def candidates(self) -> tuple[str, ...]:
        """The paths that may be imported: the named file alone, or all."""
        return (self.named,) if self.named else tuple(self.texts)


def lab_folder(path: Path) -> LabFolder | Diagnostic:
    """Returns what lies in a folder, or one file with what belongs to it, or why it cannot be read."""
    texts: dict[str, str] = {}
    unread, others = list[str](), list[str]()
    if path.is_dir():
        folder, named, packages = path, "", packages_in(((path, ""),))
        files = ProjectFiles.beside(path / "any", LoadBudget())
        paths = _below(files, folder, others=others)
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
    unread += _python(folder, [one for one in others if one.endswith(PYTHON)])
    return LabFolder(texts, named, unread, packages, others)


def _python(folder: Path, paths: Sequence[str]) -> Iterator[str]:
    """Names the Python programs that seem to start something on computers."""
    files = ProjectFiles.beside(folder / "any", LoadBudget())
    for path in paths:
        text = _text(files, folder / path) if not files.exhausted else ""
        if isinstance(text, str) and _RUNS.search(text) and (match := _STARTS.search(text)):
            line = text.count("\n", 0, match.start()) + 1
            yield f"{path}:{line}: a Python program that has `{match[0]}`; it is not read"


def _text(files: ProjectFiles, path: Path) -> str | Diagnostic:
    if not path.is_symlink() and path.is_file() and path.stat().st_size > _MAX_FILE:
        return Diagnostic("FILE002", f"it is larger than {_MAX_FILE >> 10} KiB")
    return files.named(path) if path.name.startswith(".env") else files.text(path, _ANY)


def _beside(files: ProjectFiles, path: Path) -> Iterator[str]:
    """The files that belong to one file: variables of an inventory, launch files in its folder."""
    if is_launch_xml(path.name) or path.name.endswith(PYTHON):
        names = files.names(path.parent)
        yield from (name for name in names if is_launch_xml(name) or name.endswith(PYTHON))
    if path.name.endswith(YAML):
        yield from _of_compose(path.parent, "")
    for folder in VARIABLES:
        yield from _below(files, path.parent, folder)


def _of_compose(root: Path, inside: str) -> Iterator[str]:
    """The files of variables, which are hidden, beside a Compose file."""
    found = sorted((root / inside).glob(".env*"))[:_MOST_OF_COMPOSE]
    yield from (posixpath.join(inside, one.name) for one in found if one.is_file() and not one.is_symlink())


def _below(
    files: ProjectFiles, root: Path, inside: str = "", others: list[str] | None = None
) -> Iterator[str]:
    """The files that may be read in the folder ``inside`` of another one and in those below it.

    The paths of those that are not to be read are added to ``others``.
    """
    waiting = [inside]
    for _ in range(_MAX_FOLDERS):
        if not waiting:
            return
        inside = waiting.pop(0)
        names = files.names(root / inside)
        if any("compose" in name and name.endswith(YAML) for name in names):
            yield from _of_compose(root, inside)
        for name in names:
            path = posixpath.join(inside, name)
            if not (root / path).is_dir():
                if _may_be_read(path):
                    yield path
                elif others is not None:
                    others.append(path)
            elif not (root / path).is_symlink() and name not in BUILT and path.count("/") < _MAX_DEPTH:
                waiting.append(path)


def _may_be_read(path: str) -> bool:
    name = posixpath.basename(path)
    if is_of_variables(path):
        return not name.endswith(("~", ".bak", ".orig", ".retry"))
    if name.endswith(PYTHON):
        return "launch" in path
    if name.endswith(".xml"):
        return is_launch_xml(path) or bool(_OF_DDS.search(name))
    if name.startswith("README.") and name == path:
        return True
    if is_example(name) and name.startswith(_PLAIN_NAMES[:2]):
        return True
    return is_image(path) or name.endswith(_SUFFIXES) or ("." not in name and name.startswith(_PLAIN_NAMES))


def _is_script(path: str) -> bool:
    name = posixpath.basename(path)
    if is_example(name) or name.startswith("README.") or is_of_variables(path):
        return False
    return not path.endswith((*LAUNCH, PYTHON, *YAML, ".ini"))


def is_example(name: str) -> bool:
    """Returns True for the name of a file that a person is to copy."""
    return bool(_EXAMPLE.search(name))


def is_launch_xml(path: str) -> bool:
    """Returns True for a file of XML whose name is that of a launch file."""
    name = posixpath.basename(path)
    return name.endswith(".launch") or (name.endswith(".xml") and "launch" in name)


def is_of_variables(path: str) -> bool:
    """Returns True for a file of variables of an inventory."""
    return any(part in VARIABLES for part in posixpath.dirname(path).split("/"))


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
