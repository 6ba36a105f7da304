"""The public WireGuard keys that a host knows of a swarm, below /etc/swarm, in lines of ``tunnel.keys``.

They are no part of a release: a rollback brings back no key that was retired.
"""

from __future__ import annotations

import fcntl
import os
from contextlib import contextmanager

from swarm_onboard.tunnel import keys

from . import files
from .errors import RefusedError
from .paths import KEPT
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator


def path(home: Home) -> str:
    """Returns their file."""
    return f"{folder(home)}/wireguard.keys"


def folder(home: Home) -> str:
    """Returns the folder of what a host keeps of a swarm."""
    return home.outside(f"{KEPT}/{home.swarm}")


def known(home: Home) -> str:
    """Returns the keys; empty if the host knows none."""
    return (files.read(path(home)) or b"").decode("utf-8", "replace")


def learn(home: Home, text: str) -> None:
    """Joins keys to the known ones, on the disk. Raises ``RefusedError``."""
    if not text:
        return
    try:
        make_folder(home)
        with _alone(home):
            files.remove(files.draft(path(home)))  # of an agent that was killed
            joined = keys.joined(known(home), text)
            if len(joined) > keys.LONGEST:
                raise RefusedError(f"{path(home)} would be larger than {keys.LONGEST} bytes")
            if joined != known(home):
                files.replace(path(home), joined.encode("utf-8"))
            else:
                files.sync(folder(home))  # an agent that was killed may not have done so
    except OSError as error:
        raise RefusedError(f"{path(home)}: {error.strerror}", "see `df -h /etc` on the host") from error


def retire(home: Home, host: str) -> None:
    """Retires every key of a host that is known here. Raises ``RefusedError``."""
    own = keys.Keys(known(home)).live.get(host, ())
    learn(home, "".join(keys.line(host, key, retired=True) for key in own))


def make_folder(home: Home) -> None:
    """Makes the folder, on the disk."""
    made = folder(home)
    os.makedirs(made, 0o755, exist_ok=True)
    for place in (os.path.dirname(made), os.path.dirname(os.path.dirname(made))):
        files.sync(place)


@contextmanager
def _alone(home: Home) -> Iterator[None]:
    """One agent at a time joins keys."""
    descriptor = os.open(folder(home), os.O_RDONLY | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)
