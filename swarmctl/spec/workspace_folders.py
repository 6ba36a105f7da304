"""Finds the folders of the ROS packages in the source folder of a workspace, as catkin does."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from swarmctl.ros_packages.package import MANIFEST
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
