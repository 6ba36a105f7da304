"""The log of a host's changes: a line of JSON for each that stayed or was undone, of the last ``KEPT``."""

from __future__ import annotations

import os
import time
from contextlib import suppress

from . import files, json_text
from .named_tuple import NamedTuple
from .record import Record
from .release_store import Home

KEPT = 200


class ChangeEntry(NamedTuple):
    """One change of the host. ``time``: of its clock, s since 1970; ``run``: of swarmctl, ``who`` began it;
    ``previous`` and ``next``: releases, null for none; ``previous_secrets`` and ``next_secrets``: the names
    of their sets of secrets; ``state``: applied; or undone, for the reason
    ``error``; or forgotten, with the names of hosts that left the swarm in ``error``."""

    time: float
    txid: str
    run: str
    who: str
    previous: str | None
    next: str | None
    previous_secrets: str
    next_secrets: str
    state: str
    error: str


def note(home: Home, done: Record) -> None:
    """Appends a change that has ended, on the disk once its record is. A full disk costs the line, not the
    change."""
    entry = ChangeEntry(
        round(time.time(), 3),
        done.txid,
        done.run,
        done.who,
        done.previous,
        done.next,
        done.previous_secrets,
        done.next_secrets,
        done.state,
        done.error,
    )
    with suppress(OSError):
        lines = [*_lines(home)[1 - KEPT :], json_text.dumps(entry._asdict())]
        files.replace(home.audit_file, ("\n".join(lines) + "\n").encode("utf-8"), named=False)


def entries(home: Home) -> list[ChangeEntry]:
    """Returns the changes, the oldest first; each once, though a cut of the power may have repeated one."""
    found: dict[str, ChangeEntry] = {}
    for line in _lines(home):
        with suppress(ValueError, LookupError, TypeError):
            raw = json_text.loads(line)
            found[raw["txid"]] = ChangeEntry(
                float(raw["time"]),
                str(raw["txid"]),
                str(raw["run"]),
                str(raw["who"]),
                _release(raw["previous"]),
                _release(raw["next"]),
                str(raw.get("previous_secrets", "")),
                str(raw.get("next_secrets", "")),
                str(raw["state"]),
                str(raw["error"]),
            )
    return list(found.values())


def _release(value: object) -> str | None:
    return value if isinstance(value, str) else None


def _lines(home: Home) -> list[str]:
    content = files.read(home.audit_file) if os.path.isfile(home.audit_file) else None
    return (content or b"").decode("utf-8", "replace").splitlines()
