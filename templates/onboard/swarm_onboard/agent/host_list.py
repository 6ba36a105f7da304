"""The hosts of the swarm as its operators reach them, kept on each of them: an operator on another machine
learns from it which hosts left the spec.

It is no part of a release: another host that comes or goes changes no release here. ``epoch`` is the time of
the operator's clock in s since 1970 when the list was written; ``gone`` has that time for hosts that were
taken off.
"""

from __future__ import annotations

from . import files, json_text
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Mapping

    from .host_list_messages import HostListAnswer, HostListState, HostLogin

LONGEST = 1 << 20  # bytes


def digest_of(hosts: Mapping[str, Any], gone: Mapping[str, int]) -> str:
    """Returns the digest by which two lists are compared."""
    text = json_text.dumps([hosts, gone], sort_keys=True)
    return files.digest_of(text.encode("utf-8"))[:16]


def read(home: Home) -> HostListAnswer:
    """Returns the list of this host; an empty one of epoch 0 if there is none or it is damaged."""
    raw = files.read_json(home.host_list_file)
    try:
        return {"epoch": int(raw["epoch"]), "hosts": dict(raw["hosts"]), "gone": dict(raw["gone"])}
    except (ValueError, LookupError, TypeError):
        return {"epoch": 0, "hosts": {}, "gone": {}}


def state(home: Home) -> HostListState | None:
    """Returns the epoch and the digest of the list; None if there is none."""
    found = read(home)
    if not found["epoch"]:
        return None
    return {"epoch": found["epoch"], "digest": digest_of(found["hosts"], found["gone"])}


def write(home: Home, epoch: int, hosts: Mapping[str, HostLogin], gone: Mapping[str, int]) -> bool:
    """Stores a list that is newer than the present one; the lock is held. Returns False if it is not."""
    if epoch <= read(home)["epoch"] or len(json_text.dumps([hosts, gone])) > LONGEST:
        return False
    files.write_json(home.host_list_file, {"epoch": epoch, "hosts": hosts, "gone": gone})
    return True
