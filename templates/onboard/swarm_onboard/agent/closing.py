"""The end of a change that stays: the record says so, and what nothing needs any more is removed."""

from __future__ import annotations

from . import audit, files, record, rollback
from .errors import FailedError
from .failpoint import passed
from .kept_state import State
from .record import Record
from .release_store import KEPT_RELEASES, KEPT_SETS, Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterable


def keep(home: Home, done: Record) -> None:
    """Closes the record of a change that stays, and removes what nothing needs any more."""
    states = [State(done.next or "", done.next_secrets), *done.before, *done.history]
    kept = done._replace(state=record.APPLIED, history=tuple(_newest(states)))
    files.remove(home.spare)
    audit.note(home, kept)
    try:
        record.write(home, kept)
    except OSError as error:
        raise FailedError(
            f"release {done.next} runs, but that cannot be recorded: {error.strerror}",
            "repair the disk, then deploy again",
        ) from error
    passed("done")
    rollback.collect(home, kept)
    rollback.collect_secrets(home, kept)
    passed("collect")


def _newest(states: Iterable[State]) -> list[State]:
    """The states to keep: of the newest ``KEPT_RELEASES``, each with its last ``KEPT_SETS`` sets."""
    found: list[State] = []
    for one in dict.fromkeys(states):
        releases = {other.release for other in found}
        sets = sum(other.release == one.release for other in found)
        if sets < KEPT_SETS if sets else len(releases) < KEPT_RELEASES:
            found.append(one)
    return found
