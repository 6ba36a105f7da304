"""Reads the files of a lab that may be imported, within the limits on files of a spec."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.ros_packages.launched import Place
from swarmctl.ros_packages.package import NO_PACKAGES, Packages
from swarmctl.spec.package_search import packages_in
from swarmctl.spec.workspace_folders import BUILT
from swarmctl.yamltext.limits import LoadBudget
from swarmctl.yamltext.project_files import ProjectFiles

LAUNCH = (".launch", ".launch.xml")
SCRIPTS = (".bash", ".sh", ".zsh", ".env")
YAML = (".yaml", ".yml", ".json")
VARIABLES = ("group_vars", "host_vars")
_SUFFIXES = (*LAUNCH, *SCRIPTS, *YAML, ".ini")
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
    if path.name.endswith(LAUNCH):
        yield from (name for name in files.names(path.parent) if name.endswith(LAUNCH))
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
    return name.endswith(_SUFFIXES) or ("." not in name and name.startswith(_PLAIN_NAMES))


def is_of_variables(path: str) -> bool:
    """Returns True for a file of variables of an inventory."""
    return any(part in VARIABLES for part in posixpath.dirname(path).split("/"))
