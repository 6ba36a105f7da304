"""The record of a host's last transaction, written before each step that must be undone or finished later.

States: ``applying`` -> ``pending`` (until ``deadline``) -> ``applied``; each of the first two -> ``undoing``
-> ``undone``; ``removing`` until the swarm is off the host. All but ``applied`` and ``undone`` are open.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from . import boot, files
from .release_store import Home

APPLYING = "applying"
PENDING = "pending"
UNDOING = "undoing"
REMOVING = "removing"
APPLIED = "applied"
UNDONE = "undone"
_OPEN = (APPLYING, PENDING, UNDOING, REMOVING)


class Record(NamedTuple):
    """One transaction, which ``who`` began in a ``run`` of swarmctl. ``prev`` and ``next``: digests of
    releases, None for nothing; ``touched``: its units; ``active``: those that ran before; ``reload``: daemons
    that read its files; ``deadline``: s since the boot ``boot_id``; ``error``: why it was undone."""

    state: str = ""
    txid: str = ""
    who: str = ""
    run: str = ""
    boot_id: str = ""
    deadline: float = 0.0
    prev: str | None = None
    next: str | None = None
    touched: tuple[str, ...] = ()
    active: tuple[str, ...] = ()
    reload: tuple[str, ...] = ()
    history: tuple[str, ...] = ()
    error: str = ""

    @property
    def open(self) -> bool:
        """True if it must still be confirmed, undone or finished."""
        return self.state in _OPEN

    def left(self, home: Home) -> float:
        """Returns the s until the deadline; 0 if it has passed, the host restarted, or none is awaited."""
        if self.state != PENDING or self.boot_id != boot.identity(home):
            return 0.0
        return max(0.0, self.deadline - boot.now())


def read(home: Home) -> Record:
    """Returns the last record; an empty one if there is none or it is damaged."""
    raw = files.read_json(home.record_file)
    if not isinstance(raw, dict):
        return Record()
    return Record(**{name: _fitting(raw.get(name), default) for name, default in Record()._asdict().items()})


def _fitting(value: Any, default: Any) -> Any:
    """Returns ``value`` if it has the type of ``default``, which is returned otherwise."""
    if isinstance(default, tuple):
        return tuple(one for one in value if isinstance(one, str)) if isinstance(value, list) else default
    if default is None:
        return value if isinstance(value, str) else None
    if isinstance(default, float):
        return float(value) if isinstance(value, (int, float)) else default
    return value if isinstance(value, type(default)) else default


def write(home: Home, record: Record) -> None:
    """Writes the record to the disk. Raises ``OSError``."""
    files.write_json(home.record_file, record._asdict())
    if not record.open:
        close(home)


def mark(home: Home) -> None:
    """Has the next boot look at the record. The mark is on the disk once the record is: same folder."""
    with open(home.open_mark, "ab"):
        pass


def close(home: Home) -> None:
    """Has the next boot not look at the record."""
    files.remove(home.open_mark)
