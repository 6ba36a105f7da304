"""The latches of ``swarmctl stop``: a file below /etc/swarm for each robot that is to stand.

They outlive restarts, reboots and deploys, and are no part of a release; ``remove`` takes them away.
"""

from __future__ import annotations

import os
from contextlib import suppress

from . import files, json_text
from .errors import RefusedError
from .named_tuple import NamedTuple
from .paths import stop_file
from .release_store import Home
from .texts import is_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterable

_LATEST = 1e11  # s since 1970, far from any clock


class Latch(NamedTuple):
    """Who stopped a robot, and when, in s since 1970."""

    who: str
    since: float


def robot_names(values: Any) -> list[str]:
    """Returns ``values`` if they are names of robots. Raises ``RefusedError``."""
    for one in values:
        if not is_name(one, "_-", 100):
            raise RefusedError(f"{one!r} is not a robot's name", "are swarmctl and its agent of one version?")
    return list(values)


def close(home: Home, robots: Iterable[str], latch: Latch) -> dict[str, str]:
    """Latches robots, not synced yet; returns why by robot where the disk cannot be written.

    A latch that is closed keeps who closed it. A file without its text, on a full disk, is one.
    """
    failed = {}
    text = json_text.dumps(latch._asdict()).encode("utf-8")
    with suppress(OSError):  # then each file says why
        os.makedirs(_folder(home), 0o755, exist_ok=True)
    for robot in robots:
        path = home.outside(stop_file(home.swarm, robot))
        try:
            files.write_new(path, text, 0o644)
        except OSError as error:
            if not os.path.exists(path):
                failed[robot] = f"{path} cannot be written: {error.strerror}"
            with suppress(OSError):
                os.utime(path)  # a trial that waits for its start does not begin
    return failed


def stamps(home: Home, robots: Iterable[str]) -> dict[str, int]:
    """Returns when each latched robot was last stopped, in ns since 1970."""
    found = {}
    for robot in robots:
        with suppress(FileNotFoundError):
            found[robot] = os.stat(home.outside(stop_file(home.swarm, robot))).st_mtime_ns
    return found


def sync(home: Home, robots: Iterable[str]) -> None:
    """Writes the latches of robots through to the disk, as far as it can be written."""
    for path in (*(home.outside(stop_file(home.swarm, one)) for one in robots), _folder(home)):
        with suppress(OSError):
            files.sync(path)


def release(home: Home, robots: Iterable[str], *, synced: bool = True) -> list[str]:
    """Opens latches, if ``synced`` for good; returns the robots that were latched."""
    released = [one for one in robots if files.remove(home.outside(stop_file(home.swarm, one)))]
    if released and synced:
        files.sync(_folder(home))
    return released


def closed(home: Home) -> dict[str, Latch]:
    """Returns the latch of each robot that has one; of a damaged file the robot is known."""
    found = {}
    with suppress(FileNotFoundError):
        for name in sorted(os.listdir(_folder(home))):
            raw = files.read_json(home.outside(stop_file(home.swarm, name)))
            try:
                since = float(raw["since"])
                found[name] = Latch(str(raw["who"]), since if 0 <= since < _LATEST else 0.0)
            except (TypeError, LookupError, ValueError, OverflowError):
                found[name] = Latch("somebody", 0.0)
    return found


def forget(home: Home) -> None:
    """Removes all latches of the swarm, and the folders that are empty then."""
    folder = _folder(home)
    with suppress(FileNotFoundError):
        for name in os.listdir(folder):
            files.remove(f"{folder}/{name}")
        with suppress(OSError):
            os.rmdir(folder)
            os.rmdir(os.path.dirname(folder))
            os.rmdir(os.path.dirname(os.path.dirname(folder)))


def _folder(home: Home) -> str:
    return os.path.dirname(home.outside(stop_file(home.swarm, "_")))
