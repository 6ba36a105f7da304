"""The files, folders and namespaces of a lab."""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.errors import LabError

STATE_VARIABLE = "SWARMCTL_STATE"
DEFAULT_STATE = Path("/var/lib/swarmctl")
CACHE_VARIABLE = "SWARMCTL_CACHE"
DEFAULT_CACHE = Path("/var/cache/swarmctl")
NAMESPACES = Path("/run/netns")
NAME = re.compile("[a-z0-9][a-z0-9-]{0,62}")


def labs_root() -> Path:
    """Returns the folder of all labs (``$SWARMCTL_STATE``/lab)."""
    return Path(os.environ.get(STATE_VARIABLE) or DEFAULT_STATE).absolute() / "lab"


def cache() -> Path:
    """Returns the folder of images (``$SWARMCTL_CACHE``)."""
    return Path(os.environ.get(CACHE_VARIABLE) or DEFAULT_CACHE).absolute()


@dataclass(frozen=True)
class LabPaths:
    """The paths of one lab.

    Labs never share any, not even labs of the same name in different state folders.
    """

    directory: Path

    @property
    def name(self) -> str:
        """The name of the lab."""
        return self.directory.name

    @property
    def tag(self) -> str:
        """The prefix of this lab's namespaces, cgroup and service."""
        if self.directory.parent == DEFAULT_STATE / "lab":
            return f"swarm-{self.name}"
        return f"swarm-{self.name}@{hashlib.sha256(bytes(self.directory)).hexdigest()[:6]}"

    @property
    def state(self) -> Path:
        """The saved state of the lab, in JSON."""
        return self.directory / "state.json"

    @property
    def identity(self) -> Path:
        """The private SSH key of swarmctl; the public one is beside it, with ``.pub``."""
        return self.directory / "identity"

    @property
    def known_hosts(self) -> Path:
        """The SSH host keys of the lab's hosts."""
        return self.directory / "known_hosts"

    @property
    def wireguard_keys(self) -> Path:
        """The public WireGuard keys of the lab's hosts, which differ from those of the real ones."""
        return self.directory / "wireguard"

    @property
    def socket(self) -> Path:
        """The supervisor's Unix socket."""
        return self.directory / "control"

    @property
    def log(self) -> Path:
        """The supervisor's log."""
        return self.directory / "supervisor.log"

    @property
    def hosts(self) -> Path:
        """The folder with one folder for each host."""
        return self.directory / "hosts"

    def host(self, name: str) -> HostPaths:
        """Returns the paths of one host."""
        return HostPaths(self.hosts / name)

    def namespace(self, host: str | None = None) -> str:
        """Returns the network namespace of a host, or of the operator without one."""
        return self.tag if host is None else f"{self.tag}.{host}"

    def namespaces(self) -> list[str]:
        """Returns the namespaces of this lab that exist."""
        if not NAMESPACES.is_dir():
            return []
        found = (entry.name for entry in NAMESPACES.iterdir())
        return sorted(name for name in found if name == self.tag or name.startswith(f"{self.tag}."))


@dataclass(frozen=True)
class HostPaths:
    """The paths of one host. ``upper`` is its disk; the supervisor mounts ``root`` and ``pts``."""

    directory: Path

    @property
    def upper(self) -> Path:
        """The upper directory of the host's overlay file system: what it has written."""
        return self.directory / "upper"

    @property
    def work(self) -> Path:
        """The work directory of the overlay file system."""
        return self.directory / "work"

    @property
    def root(self) -> Path:
        """The mounted root of the host."""
        return self.directory / "root"

    @property
    def pts(self) -> Path:
        """The host's pseudo terminals."""
        return self.directory / "pts"

    @property
    def containers(self) -> Path:
        """The images and containers of the host, if programs of its swarm are containers."""
        return self.directory / "containers"

    @property
    def log(self) -> Path:
        """The host's console output."""
        return self.directory / "console.log"

    @property
    def host_key(self) -> Path:
        """The public SSH host key."""
        return self.directory / "host_key.pub"


def lab_paths(name: str) -> LabPaths:
    """Returns the paths of a lab. Raises ``LabError`` for a name that could leave the folder of labs."""
    if not NAME.fullmatch(name):
        raise LabError(
            f"`{name}` cannot be the name of a lab", "use lower-case letters, digits and hyphens, 63 at most"
        )
    return LabPaths(labs_root() / name)


def all_labs() -> list[LabPaths]:
    """Returns every lab that has a folder."""
    root = labs_root()
    return [LabPaths(entry) for entry in sorted(root.iterdir()) if entry.is_dir()] if root.is_dir() else []


def last_lines(log: Path) -> list[str]:
    """Returns the last five lines of a log; none without one."""
    return log.read_text(errors="replace").splitlines()[-5:] if log.exists() else []


@contextmanager
def locked(directory: Path, timeout: float = 30.0) -> Iterator[None]:
    """Locks ``directory``, which is created if needed, until the block or the process ends.

    Raises ``LabError`` if another process holds the lock for ``timeout`` seconds.
    """
    descriptor = _lock(directory, time.monotonic() + timeout)
    try:
        yield
    finally:
        os.close(descriptor)


def _lock(directory: Path, deadline: float) -> int:
    while True:
        with suppress(FileNotFoundError):  # removed at this moment; then it is created again
            with suppress(FileExistsError):  # of `mkdir`, where it is removed between its two looks
                directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
            try:
                if _locked(descriptor) and os.path.samestat(os.fstat(descriptor), directory.stat()):
                    return os.dup(descriptor)
            finally:
                os.close(descriptor)
        if time.monotonic() > deadline:
            raise LabError(f"another swarmctl is using {directory}", "wait until it ends, or interrupt it")
        time.sleep(0.05)


def _locked(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
