"""The log of the host's changes: it has the last one, and those to which the host may go back."""

from __future__ import annotations

from swarm_onboard.agent import audit, record
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator

    from swarm_onboard.agent.record import Record
    from swarm_onboard.agent.release_store import Home

TABLE = (
    (
        "the log of a host's changes lacks its last one, or one to which it may go back",
        "a warning: `swarmctl history` cannot show who made it",
    ),
)


class Seen(NamedTuple):
    """The file, and the changes that it lacks, in words."""

    file: str
    lacks: list[str]


def observe(home: Home) -> list[Seen]:
    """Compares the log with the record of the last change; nothing without one, or while one is open."""
    last = record.read(home)
    # A change is in the log before its record says that it has ended.
    if last.state not in (record.APPLIED, record.UNDONE) or record.switched(home) is not None:
        return []
    return [Seen(home.audit_file, list(_lacks(home, last)))]


def _lacks(home: Home, last: Record) -> Iterator[str]:
    entries = audit.entries(home)
    if len(entries) >= audit.KEPT:
        return
    if last.txid not in {one.txid for one in entries}:
        yield f"the last one, by {last.who}"
    deployed = {one.next for one in entries if one.state == record.APPLIED}
    for release in dict.fromkeys(state.release for state in last.history):
        if release not in deployed and release != last.next:
            yield f"that to release {release}"


def judge(seen: Seen, host: str) -> Judged:
    """Names the changes of which nobody knows who made them."""
    if not seen.lacks:
        return Judged("ok", "has the last changes")
    text = f"{seen.file} was emptied or cut off: of the changes it lacks {'; '.join(seen.lacks)}"
    hint = f"`swarmctl history` shows what is left; sudo last on {host} shows who was there"
    return Judged("warning", text, hint)
