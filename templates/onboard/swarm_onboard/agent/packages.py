"""Finds the ROS packages and workspaces of a host by its folders, without running anything of ROS.

Looks where `ros-exec` will: the swarm's workspace with what that was built upon, /opt/ros, Debian's own ROS.
"""

from __future__ import annotations

import os

from . import files, platforms

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterable, Iterator

PACKAGE, WORKSPACE = "package:", "workspace:"
SPACES = ("devel", "install")  # of a catkin workspace, in the order in which one is taken
_MARKER = ".catkin"  # in every space; names the source folders of a devel space
_BUILT_UPON = rb"^ *CMAKE_PREFIX_PATH = r'([^']*)'"  # in its _setup_util.py
_NAME = rb"<name>\s*([^<\s]+)\s*</name>"
_NO_PACKAGES_BELOW = frozenset(("CATKIN_IGNORE", "AMENT_IGNORE", "COLCON_IGNORE", "rospack_nosubdirs"))
_MOST_FOLDERS = 20000


def found(requires: Iterable[str], outside: Callable[[str], str]) -> dict[str, str | None]:
    """Returns where each ``package:NAME`` and ``workspace:PATH`` is, or None; ignores other requirements.

    ``outside`` returns the place at which a path of the host is read.
    """
    wanted = list(requires)
    workspaces = [one[len(WORKSPACE) :] for one in wanted if one.startswith(WORKSPACE)]
    answer: dict[str, str | None] = {WORKSPACE + path: space(path, outside) for path in workspaces}
    names = [one[len(PACKAGE) :] for one in wanted if one.startswith(PACKAGE)]
    if names:
        places = _places(names, _prefixes(workspaces, outside), outside)
        answer.update((PACKAGE + name, places.get(name)) for name in names)
    return answer


def space(workspace: str, outside: Callable[[str], str]) -> str | None:
    """Returns the space of a built workspace: its devel, its install, or the folder itself."""
    for path in (*(f"{workspace}/{name}" for name in SPACES), workspace):
        if os.path.isfile(outside(f"{path}/setup.sh")):
            return path
    return None


def _prefixes(workspaces: Iterable[str], outside: Callable[[str], str]) -> list[str]:
    """Every folder with a `share`, the nearest first: a package there hides those behind."""
    import re  # noqa: PLC0415  (takes long to load, and few need it)

    own = [place for path in workspaces for place in [space(path, outside)] if place is not None]
    system = [f"{platforms.ROS}/{name}" for name in platforms.distributions(outside)]
    prefixes: list[str] = []
    for path in (*own, *system, "/usr"):
        if path not in prefixes:
            built = re.search(_BUILT_UPON, files.read(outside(f"{path}/_setup_util.py")) or b"", re.MULTILINE)
            below = os.fsdecode(built.group(1)).split(";") if built else []
            prefixes += [
                one for one in (path, *below) if one and one not in prefixes and os.path.isdir(outside(one))
            ]
    return prefixes


def _places(names: Iterable[str], prefixes: Iterable[str], outside: Callable[[str], str]) -> dict[str, str]:
    missing = set(names)
    places: dict[str, str] = {}
    for prefix in prefixes:
        for name in sorted(missing):
            if os.path.isfile(outside(f"{prefix}/share/{name}/package.xml")):
                places[name] = f"{prefix}/share/{name}"
        missing -= set(places)
        if not missing:
            break
        for source in os.fsdecode(files.read(outside(f"{prefix}/{_MARKER}")) or b"").strip().split(";"):
            for name, folder in _sources(source, outside) if source else ():
                if name in missing:
                    places.setdefault(name, folder)
        missing -= set(places)
    return places


def _sources(top: str, outside: Callable[[str], str]) -> Iterator[tuple[str, str]]:
    """The packages below a source folder, name and place, as rospack finds them."""
    import re  # noqa: PLC0415  (see above)

    cut = len(outside(""))
    for count, (folder, folders, names) in enumerate(os.walk(outside(top), followlinks=True)):
        if count > _MOST_FOLDERS:  # a link to a folder above it never ends
            return
        ignored = _NO_PACKAGES_BELOW.intersection(names)
        if "package.xml" in names and not ignored:
            name = re.search(_NAME, files.read(os.path.join(folder, "package.xml")) or b"")
            if name:
                yield name.group(1).decode("utf-8", "replace"), folder[cut:]
        if ignored or "package.xml" in names:
            folders.clear()
        folders[:] = sorted(name for name in folders if not name.startswith("."))
