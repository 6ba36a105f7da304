"""A container of the lab's image with compilers, in which packages are built on the operator's machine.

Its changes stay in the cache: packages that were installed, and builds, of which the next one compiles what
changed. It has the network of the machine, for apt.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from swarm_agent.platforms import platform as platform_in

from swarmctl.lab import paths
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image
from swarmctl.lab.hosts.processes import environment, isolated, require
from swarmctl.remote.process_session import ProcessSession
from swarmctl.remote.transport import HostError, Kind, Target

_BUSY = 5.0  # s to wait for another build in it
_MOUNT = 'mount -t overlay overlay -o "$1" "$2" && shift && shift && exec "$@"'


def build_platform() -> str:
    """Returns the platform that it builds for, as hosts report theirs; without ROS before its first use."""
    folder = image.path(compilers=True)
    if folder.is_dir():
        return platform_in(lambda path: f"{folder}{path}")
    return f"{image.DISTRIBUTION}-{platform.machine()}"


@dataclass(frozen=True)
class BuildContainer:
    """The transport to the container: each connection is one, and its commands run one after the other."""

    note: Callable[[str], None]

    @contextmanager
    def connect(self, target: Target) -> Iterator[ProcessSession]:
        """Yields a session of the container. Raises ``HostError``."""
        try:
            with _prepared(self.note) as argv:
                session = ProcessSession(argv, environment())
                try:
                    yield session
                finally:
                    session.close()
        except LabError as error:
            raise HostError(Kind.REFUSED, str(error), "; ".join(error.help_lines)) from error


@contextmanager
def _prepared(note: Callable[[str], None]) -> Iterator[tuple[str, ...]]:
    """Yields the command before each command in the container; keeps others out. Raises ``LabError``."""
    require("mmdebstrap", "systemd-nspawn", "unshare", "mount")
    whole = image.ensure(note, compilers=True)
    folder = paths.cache() / f"builder-{whole.name}"
    try:
        for part in ("upper", "work", "root"):
            (folder / part).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LabError(f"{folder} cannot be written: {error.strerror}", "free space there") from error
    with paths.locked(folder / ".lock", timeout=_BUSY):
        layers = f"lowerdir={whole},upperdir={folder / 'upper'},workdir={folder / 'work'}"
        root = str(folder / "root")
        nspawn = (
            *("systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--as-pid2", "--pipe"),
            *("--directory", root, "--machine", f"swarm-builder-{os.getpid()}", "--link-journal=no"),
            *("--resolv-conf=copy-host", "--timezone=off"),
        )
        yield isolated(("sh", "-c", _MOUNT, "sh", layers, root, *nspawn))
