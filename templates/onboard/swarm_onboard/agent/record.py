"""The requested change of a host, and the record of it, written before what must be undone or finished.

States: ``applying`` -> ``pending`` (until ``deadline``) -> ``applied``; each of the first two -> ``undoing``
-> ``undone``; ``removing`` until the swarm is off the host. All but ``applied`` and ``undone`` are open.
A change of files alone is ``switching`` until it is ``applied``: which release is current says whether it
was, so that nothing must be undone.
"""

from __future__ import annotations

from . import boot, files, secrets
from .named_tuple import NamedTuple
from .release_store import Home
from .steps import Step, targets

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any, Callable


class State(NamedTuple):
    """What a host can go back to: the digest of a release, and the name of a set of secrets or no text."""

    release: str
    secrets: str


class Change(NamedTuple):
    """``previous`` is the release that the plan was made for; ``confirm_within``: s until
    it is undone without a confirmation, 0 if none is needed; ``values``: new ones of its secrets, by name, or
    ``secrets``: the kept set to go back to; ``stop_robots``: robots that move or are under command are
    stopped; without it the change is refused; ``files_only``: it is refused if it is more than files of the
    release that nothing uses by itself; ``issued``: s since 1970, when an operator chose the release, 0 if
    that is not known."""

    txid: str
    who: str
    run: str
    previous: str | None
    next: str
    steps: list[Step]
    confirm_within: float
    values: dict[str, bytes]
    secrets: str | None = None
    stop_robots: bool = False
    files_only: bool = False
    issued: float = 0.0

    def targets(self, *kinds: str) -> list[str]:
        """Returns the targets of the steps of these kinds."""
        return targets(self.steps, *kinds)


APPLYING = "applying"
PENDING = "pending"
UNDOING = "undoing"
REMOVING = "removing"
SWITCHING = "switching"
APPLIED = "applied"
UNDONE = "undone"
FORGOTTEN = "forgotten"  # in the log alone: hosts that left were forgotten, this one is as before
_OPEN = (APPLYING, PENDING, UNDOING, REMOVING)


class Record(NamedTuple):
    """One transaction, which ``who`` began in a ``run`` of swarmctl.

    ``previous`` and ``next``: digests of releases, None for nothing; ``previous_secrets`` and
    ``next_secrets``: their sets of secrets; ``touched``: its units; ``active``: those that ran before;
    ``reload``: daemons that read its files; ``reloaded``: units that take theirs while they run;
    ``history``: the states to which the host may go back, the newest first; ``deadline``: s since the boot
    ``boot_id``; ``error``: why it was undone; ``issued``: as in ``Change``, and
    ``issued_before`` that of the release before it.
    """

    state: str = ""
    txid: str = ""
    who: str = ""
    run: str = ""
    boot_id: str = ""
    deadline: float = 0.0
    previous: str | None = None
    next: str | None = None
    previous_secrets: str = ""
    next_secrets: str = ""
    touched: tuple[str, ...] = ()
    active: tuple[str, ...] = ()
    reload: tuple[str, ...] = ()
    reloaded: tuple[str, ...] = ()
    history: tuple[State, ...] = ()
    error: str = ""
    issued: float = 0.0
    issued_before: float = 0.0

    @property
    def chosen(self) -> float:
        """When the release was chosen that the host has once the change is over, s since 1970."""
        return self.issued_before if self.state == UNDONE else self.issued

    @property
    def before(self) -> tuple[State, ...]:
        """The state before it, if there was one."""
        return (State(self.previous, self.previous_secrets),) if self.previous else ()

    @property
    def open(self) -> bool:
        """True if it must still be confirmed, undone or finished."""
        return self.state in _OPEN

    def left(self, home: Home) -> float:
        """Returns the s until the deadline; 0 if it has passed, the host restarted, or none is awaited."""
        if self.state != PENDING or self.boot_id != boot.identity(home):
            return 0.0
        return max(0.0, self.deadline - boot.now())


def begun(home: Home, change: Change, state: str) -> Record:
    """Returns the record of a change before its first step, which leaves the secrets as they are."""
    kept = secrets.current(home)
    return Record(
        state=state,
        txid=change.txid,
        who=change.who,
        run=change.run,
        boot_id=boot.identity(home),
        previous=home.current(),
        next=change.next,
        previous_secrets=kept,
        next_secrets=kept,
        issued=change.issued,
        issued_before=read(home).chosen,
    )


def read(home: Home, *, working: Callable[[], bool] = lambda: False) -> Record:
    """Returns the last record, ``switching`` resolved; an empty one if there is none or it is damaged.

    ``working``: whether its agent may still be at work. Called after the record was read, and before
    ``current`` is: an agent that has ended by then changes it no more.
    """
    found = _stored(home)
    if found.state != SWITCHING:
        return found
    at_work = working()
    if found.next == home.current():
        return found._replace(state=APPLIED)
    if at_work:
        return found._replace(state=APPLYING)
    return found._replace(state=UNDONE, error="interrupted before it changed anything")


def switched(home: Home) -> Record | None:
    """Returns the record of a change of files alone that took place and was not recorded as applied."""
    found = _stored(home)
    return found if found.state == SWITCHING and found.next == home.current() else None


def _stored(home: Home) -> Record:
    raw = files.read_json(home.record_file)
    if not isinstance(raw, dict):
        return Record()
    values = {name: _fitting(raw.get(name), default) for name, default in Record()._asdict().items()}
    return Record(**{**values, "history": _states(raw.get("history"))})


def _states(value: Any) -> tuple[State, ...]:
    pairs = [one for one in value if isinstance(one, list)] if isinstance(value, list) else []
    return tuple(State(*one) for one in pairs if len(one) == 2 and all(isinstance(part, str) for part in one))


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
