"""The log of a host's changes: a line of JSON for each that stayed or was undone, of the last ``KEPT``."""

from __future__ import annotations

import os
import time
from contextlib import suppress

from . import files, json_text
from .record import Record
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .history_messages import ChangeEntry

KEPT = 200


def note(home: Home, done: Record) -> None:
    """Appends a change that has ended, on the disk once its record is. A full disk costs the line, not the
    change."""
    entry: ChangeEntry = {
        "time": round(time.time(), 3),
        "txid": done.txid,
        "run": done.run,
        "who": done.who,
        "previous": done.previous,
        "next": done.next,
        "previous_secrets": done.previous_secrets,
        "next_secrets": done.next_secrets,
        "state": done.state,
        "error": done.error,
    }
    with suppress(OSError):
        lines = [*_lines(home)[1 - KEPT :], json_text.dumps(entry)]
        files.replace(home.audit_file, ("\n".join(lines) + "\n").encode("utf-8"), named=False)


def entries(home: Home) -> list[ChangeEntry]:
    """Returns the changes, the oldest first; each once, though a cut of the power may have repeated one."""
    found: dict[str, ChangeEntry] = {}
    for line in _lines(home):
        with suppress(ValueError, LookupError, TypeError):
            raw = json_text.loads(line)
            found[raw["txid"]] = {
                "time": float(raw["time"]),
                "txid": str(raw["txid"]),
                "run": str(raw["run"]),
                "who": str(raw["who"]),
                "previous": _release(raw["previous"]),
                "next": _release(raw["next"]),
                "previous_secrets": str(raw.get("previous_secrets", "")),
                "next_secrets": str(raw.get("next_secrets", "")),
                "state": str(raw["state"]),
                "error": str(raw["error"]),
            }
    return list(found.values())


def _release(value: object) -> str | None:
    return value if isinstance(value, str) else None


def _lines(home: Home) -> list[str]:
    content = files.read(home.audit_file) if os.path.isfile(home.audit_file) else None
    return (content or b"").decode("utf-8", "replace").splitlines()
