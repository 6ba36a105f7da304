"""The folders to the release: units run in accounts of their own, which must be able to enter them."""

from __future__ import annotations

import os
import stat

from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    ("accounts of units cannot go through a folder to the release", "unhealthy: their next start fails"),
)


class Seen(NamedTuple):
    """The folders to the release that others than root cannot enter, outer ones first."""

    closed: list[str]


def observe(home: Home) -> list[Seen]:
    """Returns the folders without permission for others; nothing without a release."""
    digest = home.current()
    if digest is None:
        return []
    folders = (os.path.dirname(home.path), home.path, f"{home.path}/releases", home.release(digest))
    return [Seen([one for one in folders if os.path.isdir(one) and not os.stat(one).st_mode & stat.S_IXOTH])]


def judge(seen: Seen, host: str) -> Judged:
    """Names the folders that are closed."""
    if not seen.closed:
        return Judged("ok", "units can read the release")
    folders = " ".join(seen.closed)
    text = f"units cannot read the release at their next start: only root may enter {folders}"
    return Judged("bad", text, f"on {host}: sudo chmod go+rx {folders}")
