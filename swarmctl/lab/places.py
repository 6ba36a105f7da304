"""Where a lab keeps its things, and what its namespaces are called."""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
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
    """The folder of all labs; ``$SWARMCTL_STATE`` moves it."""
    return Path(os.environ.get(STATE_VARIABLE) or DEFAULT_STATE).absolute() / "lab"


def cache() -> Path:
    """The folder of images; ``$SWARMCTL_CACHE`` moves it."""
    return Path(os.environ.get(CACHE_VARIABLE) or DEFAULT_CACHE).absolute()


@dataclass(frozen=True)
class Home:
    """The places of one lab. Two labs share none, not even under one name in different state folders."""

    directory: Path

    @property
    def name(self) -> str:
        return self.directory.name

    @property
    def tag(self) -> str:
        """The lab's name among everything that lives outside its folder."""
        if self.directory.parent == DEFAULT_STATE / "lab":
            return f"swarm-{self.name}"
        return f"swarm-{self.name}@{hashlib.sha256(bytes(self.directory)).hexdigest()[:6]}"

    @property
    def state(self) -> Path:
        return self.directory / "state.json"

    @property
    def identity(self) -> Path:
        """The private key with which swarmctl logs into the hosts; ``.pub`` lies beside it."""
        return self.directory / "identity"

    @property
    def known_hosts(self) -> Path:
        return self.directory / "known_hosts"

    @property
    def socket(self) -> Path:
        return self.directory / "control"

    @property
    def log(self) -> Path:
        return self.directory / "supervisor.log"

    @property
    def hosts(self) -> Path:
        return self.directory / "hosts"

    def host(self, name: str) -> HostHome:
        return HostHome(self.hosts / name)

    def namespace(self, host: str | None = None) -> str:
        """The network namespace of a host, or of the operator."""
        return self.tag if host is None else f"{self.tag}.{host}"

    def namespaces(self) -> list[str]:
        """The namespaces of this lab that exist."""
        if not NAMESPACES.is_dir():
            return []
        found = (entry.name for entry in NAMESPACES.iterdir())
        return sorted(name for name in found if name == self.tag or name.startswith(f"{self.tag}."))


@dataclass(frozen=True)
class HostHome:
    """The places of one host. ``upper`` is its disk; ``root`` and ``pts`` are the supervisor's mounts."""

    directory: Path

    @property
    def upper(self) -> Path:
        return self.directory / "upper"

    @property
    def work(self) -> Path:
        return self.directory / "work"

    @property
    def root(self) -> Path:
        return self.directory / "root"

    @property
    def pts(self) -> Path:
        return self.directory / "pts"

    @property
    def log(self) -> Path:
        return self.directory / "console.log"

    @property
    def host_key(self) -> Path:
        """The public half of the key by which the host is known."""
        return self.directory / "host_key.pub"


def home(name: str) -> Home:
    """The places of a lab. What is no name is refused: it would lead out of the folder of labs."""
    if not NAME.fullmatch(name):
        raise LabError(
            f"`{name}` cannot be the name of a lab", "use lower-case letters, digits and hyphens, 63 at most"
        )
    return Home(labs_root() / name)


def homes() -> list[Home]:
    """All labs that left something in the state folder."""
    root = labs_root()
    return [Home(entry) for entry in sorted(root.iterdir()) if entry.is_dir()] if root.is_dir() else []


@contextmanager
def locked(directory: Path, patience: float = 30.0) -> Iterator[None]:
    """Make ``directory`` if need be, and hold it alone. A process that dies lets go."""
    descriptor = _lock(directory, time.monotonic() + patience)
    try:
        yield
    finally:
        os.close(descriptor)


def _lock(directory: Path, deadline: float) -> int:
    while True:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if directory.exists() and os.path.samestat(os.fstat(descriptor), directory.stat()):
                return descriptor
        except BlockingIOError:
            if time.monotonic() > deadline:
                os.close(descriptor)
                raise LabError(
                    f"another swarmctl is at work in {directory}", "wait for it to end, or interrupt it"
                ) from None
        os.close(descriptor)
        time.sleep(0.05)
