"""The process of the recovery unit: it undoes what nobody finishes, and ends once nothing is open.

At boot, before any unit of the swarm: a change of an earlier boot is undone, a removal finished, and the
robots of a trial are latched. While a change is made: if its agent dies, or nobody confirms it until the
deadline, it is undone.
"""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress

from swarm_onboard.common.systemd import Notifier

from . import boot, lock, record, trial_guard
from .errors import RefusedError
from .release_store import Home, home_of

_WHO = "the recovery of an interrupted deploy"
_LOOK_EVERY = 1.0  # s


def main(swarm: str) -> None:
    """Runs until nothing is open. Raises ``OSError`` and ``RefusedError`` if files cannot be restored."""
    os.umask(0o022)
    os.chdir("/")
    home = home_of(swarm)
    last = record.read(home)
    if last.open and last.boot_id != boot.identity(home):
        settle(home)
    trial_guard.settle(home)
    Notifier().ready()
    settle(home)  # begins with a wait for the lock, which the agent of a change holds while it lives
    while record.read(home).open:
        time.sleep(_LOOK_EVERY)
        if not record.read(home).left(home):
            settle(home)


def settle(home: Home) -> None:
    """Undoes or finishes what is open and waits for nobody; waits for the lock."""
    with suppress(FileNotFoundError), lock.held_while_there(home, _WHO, float("inf")):
        found = record.read(home)
        if found.open and not found.left(home):
            _end(home, found)
        elif not found.open:
            record.close(home)


def _end(home: Home, found: record.Record) -> None:
    """Finishes a removal, undoes a change. Loads what that takes: most changes end without it."""
    from . import rollback, withdrawal  # noqa: PLC0415

    if found.state == record.REMOVING:
        withdrawal.withdraw(home, found.who)
    else:
        print(rollback.undo(home, found, rollback.cause(home, found)).message, file=sys.stderr)


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except (OSError, RefusedError) as error:
        sys.exit(f"the files of swarm {sys.argv[1]} cannot be restored: {error}")
