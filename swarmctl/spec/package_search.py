"""Finds the ROS packages in a folder. Reads regular files only, no links, and no more than the limits."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from swarmctl.ros_packages.package import MANIFEST, Package, Packages, package_of
from swarmctl.yamltext.files import content
from swarmctl.yamltext.project_files import ProjectFiles

MAX_DEPTH = 5  # folders between a workspace and its packages
MAX_FOLDERS = 5000  # that are looked at
BUILT = {"build", "devel", "install", "logs", "node_modules", "__pycache__"}  # what builds leave
IGNORE_MARKERS = {"AMENT_IGNORE", "CATKIN_IGNORE", "COLCON_IGNORE"}


class WorkspaceFolderError(Exception):
    """Why the packages of a folder are not known."""


def package_folders(top: Path, files: ProjectFiles) -> Iterator[Path]:
    """Yields the folders with a package.xml in and below ``top``, sorted; none lies in another one.

    A folder with an ignore marker and what is below it is left out. A link to a folder of the spec is
    followed. Raises ``WorkspaceFolderError`` for a link to another one, and for too many folders.
    """
    waiting = [(top, 0)]
    seen: set[str] = set()
    while waiting:
        folder, depth = waiting.pop()
        real = os.path.realpath(folder)
        names = set(files.names(folder))
        if real in seen or names & IGNORE_MARKERS:
            continue
        seen.add(real)
        if len(seen) > MAX_FOLDERS:
            raise WorkspaceFolderError(f"has more than {MAX_FOLDERS} folders")
        if MANIFEST in names:
            yield folder
        elif depth < MAX_DEPTH:
            inner = (folder / name for name in sorted(names - BUILT, reverse=True))
            waiting += [(path, depth + 1) for path in inner if _is_followed(path, top, files)]


def _is_followed(path: Path, top: Path, files: ProjectFiles) -> bool:
    if not path.is_dir():
        return False
    if path.is_symlink() and files.refusal(path):
        raise WorkspaceFolderError(
            f"has the link {path.relative_to(top)}, which leads out of the spec's folder"
        )
    return True


_MAX_ENTRIES = 20_000  # names that are looked at below one folder
_MAX_PACKAGES = 500
_MAX_BYTES = 8 << 20  # of all files that are read
_MAX_FILE = 256 << 10  # of one file
_READ = (".launch", ".xml", ".msg", ".action", ".test", "CMakeLists.txt")


@dataclass
class _Left:
    entries: int
    bytes: int


Folders = tuple[tuple[Path, str], ...]  # each with the path that messages show for it
Search = Callable[[Folders], Packages]


def packages_in(folders: Folders) -> Packages:
    """Returns the packages below folders.

    A package that exceeds the limits counts as unknown.
    """
    found: dict[str, Package] = {}
    for folder, shown in folders:
        left = _Left(_MAX_ENTRIES, _MAX_BYTES)
        for path in _package_folders(str(folder), left):
            relative = os.path.relpath(path, folder)
            package = _package(path, os.path.normpath(os.path.join(shown, relative)), left)  # noqa: PTH118
            if package is not None and len(found) < _MAX_PACKAGES:
                found.setdefault(os.path.realpath(path), package)
    return Packages(tuple(found.values()))


def _package_folders(folder: str, left: _Left) -> Iterator[str]:
    waiting = [(folder, 0)]
    while waiting:
        path, depth = waiting.pop()
        entries = _entries(path, left)
        names = {one.name for one in entries}
        if names & IGNORE_MARKERS:
            continue
        if MANIFEST in names:
            yield path
        elif depth < MAX_DEPTH:
            inner = (one for one in entries if one.name not in BUILT)
            waiting += [(one.path, depth + 1) for one in inner if one.is_dir(follow_symlinks=False)][::-1]


def _entries(path: str, left: _Left) -> Sequence[os.DirEntry[str]]:
    """The names in a folder, without hidden ones; none once too many were looked at."""
    found: list[os.DirEntry[str]] = []
    try:
        with os.scandir(path) as entries:
            for one in entries:
                left.entries -= 1
                if left.entries < 0:
                    return ()
                if not one.name.startswith("."):
                    found.append(one)
    except OSError:
        return ()
    return sorted(found, key=lambda one: one.name)


def _package(folder: str, shown: str, left: _Left) -> Package | None:
    try:
        return _read(folder, shown, left)
    except OSError:  # it changes while it is read
        return None


def _read(folder: str, shown: str, left: _Left) -> Package | None:
    files: dict[str, bool] = {}
    contents: dict[str, bytes] = {}
    waiting = [(folder, "")]
    while waiting:
        path, prefix = waiting.pop()
        for one in _entries(path, left):
            name = prefix + one.name
            if one.is_dir(follow_symlinks=False) and one.name not in BUILT:
                if name.count("/") < MAX_DEPTH:
                    waiting.append((one.path, f"{name}/"))
            elif one.is_file():
                files[name] = bool(one.stat().st_mode & 0o111)
                if one.name.endswith(_READ) and (text := _content(one, left)) is not None:
                    contents[name] = text
        if left.entries < 0 or left.bytes < 0:
            return None
    return package_of(shown, files, contents)


def _content(entry: os.DirEntry[str], left: _Left) -> bytes | None:
    found = entry.stat(follow_symlinks=False)
    if not stat.S_ISREG(found.st_mode) or found.st_size > _MAX_FILE:
        return None
    left.bytes -= found.st_size
    try:
        return content(Path(entry.path)) if left.bytes >= 0 else None
    except OSError:
        return None
