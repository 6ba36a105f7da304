"""``launch_files``: launch files of the host's own ROS packages, without running anything of ROS."""

from __future__ import annotations

import hashlib
import os
import posixpath
import stat

from swarm_agent import packages
from swarm_agent.clip import clipped
from swarm_agent.release_store import home_of
from swarm_agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_agent.messages import LaunchFilesAnswer, LaunchFilesRequest, PackageAnswer

LARGEST_FILE = 256 << 10
LARGEST_ANSWER = 2 << 20  # bytes of all texts
MOST_FILES = 300
_MOST_NAMES = 100  # in a folder `launch`
_READ = (".launch", ".xml", ".test")
_FOLDER = "launch"


def handle(request: LaunchFilesRequest, payload: bytes, report: Report) -> LaunchFilesAnswer:
    """Returns the packages in ``files`` with what they have of these paths, and the launch files among these:
    their texts, or only the digests of them."""
    outside = home_of(request["swarm"]).outside
    wanted = {str(name): list(map(str, paths)) for name, paths in request["files"].items()}
    names = [packages.PACKAGE + name for name in wanted]
    places = packages.found([*map(str, request["requires"]), *names], outside)
    left, count = LARGEST_ANSWER, MOST_FILES
    answer: dict[str, PackageAnswer] = {}
    for name, paths in wanted.items():
        folder = places.get(packages.PACKAGE + name)
        found: PackageAnswer = {"folder": folder, "has": [], "digests": {}, "texts": {}, "launch": []}
        answer[name] = found
        for path in paths if folder is not None else ():
            count -= 1
            there, content = _look(outside(f"{folder}/{posixpath.normpath('/' + path)[1:]}"))
            left -= len(content)
            if there and left >= 0 and count >= 0:
                found["has"].append(path)
                text = content.decode("utf-8", "replace")
                if text and request["texts"]:
                    found["texts"][path] = text
                elif text:
                    found["digests"][path] = hashlib.sha256(text.encode()).hexdigest()
        if folder is not None and len(found["has"]) < len(paths):
            found["launch"] = _names(outside(f"{folder}/{_FOLDER}"))
    return {"packages": answer, "complete": left >= 0 and count >= 0}


def _look(place: str) -> tuple[bool, bytes]:
    """Whether there is such a file or folder, and the content of a launch file that is not too large."""
    try:
        descriptor = os.open(place, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False, b""
    try:
        found = os.fstat(descriptor)
        is_read = stat.S_ISREG(found.st_mode) and found.st_size <= LARGEST_FILE and place.endswith(_READ)
        return True, os.read(descriptor, LARGEST_FILE) if is_read else b""
    finally:
        os.close(descriptor)


def _names(folder: str) -> list[str]:
    """The launch files in a folder, by their path below the package."""
    try:
        names = sorted(os.listdir(folder))
    except OSError:
        return []
    return [clipped(f"{_FOLDER}/{name}") for name in names if name.endswith(_READ)][:_MOST_NAMES]
