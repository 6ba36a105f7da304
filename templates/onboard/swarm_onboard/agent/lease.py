"""The lease of a swarm: one run of swarmctl changes it at a time, on all of its hosts.

A run asks every host for it before its first change. The ``epoch`` counts the leases of a host: a request of
a run whose lease another one has taken over is refused. A lease ends when it is given back, after ``SECONDS``
without a request of its run, and with the boot. So it is not synced, which takes long on a memory card:
what a cut of the power leaves of it is of an earlier boot.
"""

from __future__ import annotations

import os
from contextlib import contextmanager, suppress

from . import boot, files, json_text, lock
from .errors import RefusedError
from .named_tuple import NamedTuple
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator, Protocol

    class Leasing(lock.Locking, Protocol):
        """A request that changes the host. ``run``: the run of swarmctl that has the lease, or empty."""

        @property
        def run(self) -> str: ...


SECONDS = 60.0  # the runner renews a lease three times in that time


class Lease(NamedTuple):
    """The last lease of a host. ``until``: s since the boot ``boot_id``; ``run`` is empty if it was given
    back."""

    epoch: int = 0
    run: str = ""
    who: str = ""
    boot_id: str = ""
    until: float = 0.0

    def left(self, home: Home) -> float:
        """Returns the s until it ends; 0 if it has ended."""
        if not self.run or self.boot_id != boot.identity(home):
            return 0.0
        return min(max(0.0, self.until - boot.now()), SECONDS)


def read(home: Home) -> Lease:
    """Returns the last lease; an empty one if there is none or its file is damaged."""
    raw = files.read_json(home.lease_file)
    try:
        return Lease(int(raw["epoch"]), str(raw["run"]), str(raw["who"]), raw["boot_id"], float(raw["until"]))
    except (ValueError, LookupError, TypeError):
        return Lease()


def ask(home: Home, run: str, who: str, breaks: str) -> Lease:
    """Gives the lease to ``run``, or renews it; the lock is held. Returns the lease of another run that has
    not ended, unless it is ``breaks``."""
    found = read(home)
    if found.run == run:
        return _renewed(home, found)
    if found.left(home) and found.run != breaks:
        return found
    return _renewed(home, Lease(found.epoch + 1, run, who))


def give_back(home: Home, run: str) -> Lease:
    """Ends the lease of ``run``; the lock is held. Returns the lease of the host."""
    found = read(home)
    if found.run == run:
        found = Lease(found.epoch)
        _write(home, found)
    return found


@contextmanager
def held_for(home: Home, request: Leasing) -> Iterator[None]:
    """Holds the lock for a request that changes the host. Raises ``RefusedError`` without the lease.

    A request that names no ``run`` needs none, but is refused while there is one.
    """
    with lock.held_for(home, request):
        run = str(request.run)
        found = read(home)
        if run and (found.run != run or found.boot_id != boot.identity(home)):
            raise RefusedError(
                f"the lease of this run has ended: {_other(home, found)}",
                "`swarmctl plan` shows what the host has; then run the same command again",
            )
        if not run and found.left(home):
            raise RefusedError(
                f"locked by {found.who}", "wait until that deploy has ended, then run the same command again"
            )
        yield
        if run:
            with suppress(FileNotFoundError):  # the swarm was removed
                _renewed(home, found)


def _other(home: Home, found: Lease) -> str:
    return f"{found.who} has it" if found.left(home) else "others may have changed the host since"


def _renewed(home: Home, lease: Lease) -> Lease:
    lease = lease._replace(boot_id=boot.identity(home), until=boot.now() + SECONDS)
    _write(home, lease)
    return lease


def _write(home: Home, lease: Lease) -> None:
    new = files.draft(home.lease_file)
    files.remove(new)
    files.write_new(new, json_text.dumps(lease._asdict()).encode("utf-8"), 0o644)
    os.rename(new, home.lease_file)
