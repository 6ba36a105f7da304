"""``history``: the last changes of the host."""

from __future__ import annotations

from swarm_onboard.agent import audit, record, rollback, secrets
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.steps import Step

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Sequence


class Request(NamedTuple):
    """The last changes of the host. ``to``: a kept release and a set of secrets; the steps to
    there are wanted, too."""

    swarm: str
    to: Sequence[str] = ()


class Answer(NamedTuple):
    """``entries``: the oldest first; ``release``: the current one, with the set ``secrets``; ``releases`` and
    ``secret_sets``: those that it could have again without a deploy; ``last``: the last transaction;
    ``steps``: with ``to`` only."""

    entries: list[audit.ChangeEntry]
    release: str | None
    secrets: str
    releases: list[str]
    secret_sets: list[str]
    last: str
    steps: list[Step] | None = None


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the changes, the oldest first, and the releases that the host still has."""
    home = home_of(request.swarm)
    return Answer(
        audit.entries(home),
        home.current(),
        secrets.current(home),
        home.releases(),
        secrets.sets(home),
        record.read(home).txid,
        rollback.steps_back(home, *request.to) if request.to else None,
    )
