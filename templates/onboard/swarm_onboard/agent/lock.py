"""One writer a swarm: a lock that the kernel frees when its holder dies, however it dies."""

from __future__ import annotations

import fcntl
import os
import time
from contextlib import contextmanager

from . import json_text
from .errors import RefusedError
from .release_store import Home, unwritable

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ContextManager, Iterator, Protocol

    class Locking(Protocol):
        """A request that needs the lock. ``who`` sends it, for whoever finds the host locked; ``wait``: s to
        wait for another holder."""

        @property
        def who(self) -> str: ...
        @property
        def wait(self) -> float: ...


_AGAIN = 0.02  # s between attempts: the recovery process looks at the record for less than that


def _path(home: Home) -> str:
    return home.state + "/lock"


def held_for(home: Home, request: Locking) -> ContextManager[None]:
    """Holds the lock for the operator of ``request``, and waits for it as requested, at most 60 s."""
    return held(home, operator_in(request), min(float(request.wait), 60))


def operator_in(request: Locking) -> str:
    """Returns who sends the request, as text for people."""
    return str(request.who)[:200]


@contextmanager
def held(home: Home, who: str, patience: float) -> Iterator[None]:
    """Holds the lock, after waiting for at most ``patience`` seconds. Raises ``RefusedError``."""
    try:
        home.prepare()
        descriptor = os.open(_path(home), os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o600)
        os.fchmod(descriptor, 0o600)  # flock(2) also locks a file that is open for reading only
        os.close(descriptor)
    except OSError as error:
        raise unwritable(home, error) from error
    with held_while_there(home, who, patience):
        yield


@contextmanager
def held_while_there(home: Home, who: str, patience: float) -> Iterator[None]:
    """As ``held``, but makes no folder. Raises ``FileNotFoundError`` once the swarm is not on the host."""
    end = time.monotonic() + patience
    while True:
        descriptor = os.open(_path(home), os.O_RDWR | os.O_CLOEXEC)
        try:
            if _taken(descriptor, home):
                os.ftruncate(descriptor, 0)
                os.pwrite(descriptor, json_text.dumps({"who": who, "pid": os.getpid()}).encode("utf-8"), 0)
                yield
                return
            other = _name(os.pread(descriptor, 4096, 0))
        finally:
            os.close(descriptor)
        if time.monotonic() >= end:
            raise RefusedError(
                f"locked by {other}", "wait until that deploy has ended, then run the same command again"
            )
        time.sleep(_AGAIN)


def _taken(descriptor: int, home: Home) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    # The folder may have been removed, and the lock with it, between opening and locking.
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(_path(home)))
    except FileNotFoundError:
        return False


def holder(home: Home) -> str | None:
    """Returns who holds the lock now, or None."""
    try:
        descriptor = os.open(_path(home), os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
        return None
    except BlockingIOError:
        return _name(os.pread(descriptor, 4096, 0))
    finally:
        os.close(descriptor)


def _name(content: bytes) -> str:
    try:
        value = json_text.loads(content.decode("utf-8"))
        return "{} (process {})".format(value["who"], value["pid"])
    except (ValueError, LookupError, TypeError):
        return "another deploy"
