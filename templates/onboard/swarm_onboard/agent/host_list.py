"""The hosts of the swarm as its operators reach them, kept on each of them: an operator on another machine
learns from it which hosts left the spec.

It is no part of a release: another host that comes or goes changes no release here. ``epoch`` is the time of
the operator's clock in s since 1970 when the list was written; ``gone`` has that time for hosts that were
taken off.
"""

from __future__ import annotations

from . import files, json_text
from .named_tuple import NamedTuple
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Mapping

LONGEST = 1 << 20  # bytes


class HostLogin(NamedTuple):
    """How a host is reached; ``via``: the host to jump through; ``declared``: which of `user` and `port` the
    spec sets. The host keeps it as a JSON object."""

    address: str
    user: str
    port: int
    via: str | None
    declared: list[str]


class HostList(NamedTuple):
    """``epoch``: s since 1970, when an operator wrote the list; 0 without one; ``gone``: when hosts were
    taken off it."""

    epoch: int
    hosts: dict[str, HostLogin]
    gone: dict[str, int]


class HostListState(NamedTuple):
    """The list of a host, short: when it was written, and its digest."""

    epoch: int
    digest: str


def digest_of(hosts: Mapping[str, Any], gone: Mapping[str, int]) -> str:
    """Returns the digest by which two lists are compared. ``hosts``: as JSON objects."""
    text = json_text.dumps([hosts, gone], sort_keys=True)
    return files.digest_of(text.encode("utf-8"))[:16]


def read(home: Home) -> HostList:
    """Returns the list of this host; an empty one of epoch 0 if there is none or it is damaged."""
    raw = files.read_json(home.host_list_file)
    try:
        return HostList(int(raw["epoch"]), dict(raw["hosts"]), dict(raw["gone"]))
    except (ValueError, LookupError, TypeError):
        return HostList(0, {}, {})


def state(home: Home) -> HostListState | None:
    """Returns the epoch and the digest of the list; None if there is none."""
    found = read(home)
    return HostListState(found.epoch, digest_of(found.hosts, found.gone)) if found.epoch else None


def write(home: Home, epoch: int, hosts: Mapping[str, Any], gone: Mapping[str, int]) -> bool:
    """Stores a list that is newer than the present one; the lock is held. Returns False if it is not."""
    if epoch <= read(home).epoch or len(json_text.dumps([hosts, gone])) > LONGEST:
        return False
    files.write_json(home.host_list_file, {"epoch": epoch, "hosts": hosts, "gone": gone})
    return True
