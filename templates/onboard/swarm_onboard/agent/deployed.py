"""What is deployed on the host: how it deviates from its release, and its last change."""

from __future__ import annotations

from . import edits, lock, record, system_links
from .edits import Drift
from .manifest import EMPTY, NAME, Manifest
from .named_tuple import NamedTuple
from .release_store import Home


class Transaction(NamedTuple):
    """The last deploy: digests of the releases before and after it (null: none). ``state`` as in ``record``,
    empty without one; ``left``: s until it is undone without a confirmation; ``error``: why it was undone;
    ``chosen``: s since 1970, when an operator chose the release that it left, 0 if that is not known."""

    txid: str
    state: str
    who: str
    previous: str | None
    next: str | None
    left: float
    error: str
    chosen: float = 0.0


def drift(home: Home, digest: str | None, manifest: Manifest | None) -> Drift:
    """Returns deviations from the current release; without one, or with a damaged manifest, what is left of
    it."""
    if digest is None or manifest is None:
        return Drift(
            {NAME: "damaged"} if manifest is None else {},
            system_links.link_deviations(home, {}),
            system_links.block_deviations(home, None, EMPTY),
        )
    return edits.drift(home, digest, manifest)


def last_change(home: Home) -> Transaction:
    """Returns the last change, as far as its record has it."""
    last = record.read(home, working=lambda: lock.holder(home) is not None)
    left, error, chosen = round(last.left(home), 1), last.error, last.chosen
    return Transaction(last.txid, last.state, last.who, last.previous, last.next, left, error, chosen)
