"""Reads the files of a lab that may be imported, within the limits on files of a spec."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.importing.draft import Unread
from swarmctl.ros_packages.launched import Place
from swarmctl.ros_packages.package import NO_PACKAGES, Packages
from swarmctl.spec.package_search import packages_in
from swarmctl.yamltext.limits import LoadBudget
from swarmctl.yamltext.project_files import ProjectFiles

LAUNCH = (".launch", ".launch.xml")
SCRIPTS = (".bash", ".sh", ".zsh", ".env")
YAML = (".yaml", ".yml")
VARIABLES = ("group_vars", "host_vars")
_OTHERS = (".ini", ".json")
_PLAIN_NAMES = ("hosts", "inventory", "env", "setup", "bashrc", "environment")  # without a suffix
_MAX_FILE = 256 << 10
_MAX_FOLDERS = 500
_MAX_DEPTH = 6
_BUILT = {"build", "devel", "install", "logs", "node_modules", "__pycache__"}
ANY = ("",)  # every name ends with it


@dataclass(frozen=True)
class LabFolder:
    """The texts of a folder by their path in it; ``named`` is the one file that is meant, if it is one."""

    texts: Mapping[str, str]
    named: str = ""
    unread: tuple[Unread, ...] = ()
    packages: Packages = NO_PACKAGES

    def candidates(self) -> tuple[str, ...]:
        """The paths that may be imported: the named file alone, or all."""
        return (self.named,) if self.named else tuple(self.texts)


def lab_folder(path: Path) -> LabFolder | Diagnostic:
    """Returns what lies in a folder, or one file with what belongs to it, or why it cannot be read."""
    is_file = not path.is_dir()
    folder = path.parent if is_file else path
    files = ProjectFiles.beside(path, LoadBudget()) if is_file else _files_in(path)
    texts: dict[str, str] = {}
    unread: list[Unread] = []
    if is_file:
        text = files.named(path)
        if isinstance(text, Diagnostic):
            return text
        texts[path.name] = text
    for relative in _beside(files, path) if is_file else _below(files, folder, "", 0, [_MAX_FOLDERS]):
        if files.exhausted:
            unread.append(Unread(Place(relative, 0), "it, and what follows, are too many files or too large"))
            break
        if relative not in texts:
            found = _text(files, folder / relative)
            if isinstance(found, Diagnostic):
                line = found.span.line if found.span else 0
                unread.append(Unread(Place(relative, line), found.message))
            else:
                texts[relative] = found
    packages = NO_PACKAGES if is_file else packages_in(((folder, ""),))
    return LabFolder(texts, path.name if is_file else "", tuple(unread), packages)


def _files_in(folder: Path) -> ProjectFiles:
    return ProjectFiles.beside(folder / "any", LoadBudget())


def _text(files: ProjectFiles, path: Path) -> str | Diagnostic:
    try:
        too_large = not path.is_symlink() and path.stat().st_size > _MAX_FILE
    except OSError:
        too_large = False  # reading it reports the error
    if too_large:
        return Diagnostic("FILE002", f"it is larger than {_MAX_FILE >> 10} KiB")
    return files.text(path, ANY)


def _beside(files: ProjectFiles, path: Path) -> Iterator[str]:
    """The files that belong to one file: variables of an inventory, launch files in its folder."""
    if path.name.endswith(LAUNCH):
        yield from (name for name in files.names(path.parent) if name.endswith(LAUNCH))
    for folder in VARIABLES:
        yield from _below(files, path.parent, folder, 1, [_MAX_FOLDERS])


def _below(files: ProjectFiles, root: Path, inside: str, depth: int, left: list[int]) -> Iterator[str]:
    left[0] -= 1
    if left[0] < 0 or depth > _MAX_DEPTH:
        return
    folder = root / inside
    for name in files.names(folder):
        relative = posixpath.join(inside, name)
        if not (folder / name).is_symlink() and (folder / name).is_dir():
            if name not in _BUILT:
                yield from _below(files, root, relative, depth + 1, left)
        elif _may_be_read(relative):
            yield relative


def _may_be_read(path: str) -> bool:
    folder, name = posixpath.split(path)
    if any(part in VARIABLES for part in folder.split("/")):
        return not name.endswith(("~", ".bak", ".orig", ".retry"))
    suffixes = (*LAUNCH, *SCRIPTS, *YAML, *_OTHERS)
    return name.endswith(suffixes) or ("." not in name and name.startswith(_PLAIN_NAMES))
