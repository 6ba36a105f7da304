"""What is deployed on the host: how it deviates from its release, and its last change."""

from __future__ import annotations

from . import edits, lock, record, system_links
from .manifest import EMPTY, NAME, Manifest
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .messages import Drift, Transaction


def drift(home: Home, digest: str | None, manifest: Manifest | None) -> Drift:
    """Returns deviations from the current release; without one, or with a damaged manifest, what is left of
    it."""
    if digest is None or manifest is None:
        return {
            "files": {NAME: "damaged"} if manifest is None else {},
            "links": system_links.link_deviations(home, {}),
            "blocks": system_links.block_deviations(home, None, EMPTY),
        }
    return edits.drift(home, digest, manifest)


def last_change(home: Home) -> Transaction:
    """Returns the last change, as far as its record has it."""
    last = record.read(home, working=lambda: lock.holder(home) is not None)
    return {
        "txid": last.txid,
        "state": last.state,
        "who": last.who,
        "previous": last.previous,
        "next": last.next,
        "left": round(last.left(home), 1),
        "error": last.error,
    }
