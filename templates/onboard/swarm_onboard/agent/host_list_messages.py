"""Requests and answers of ``host_list``; see ``messages``."""

from __future__ import annotations

from typing import Literal, TypedDict


class HostLogin(TypedDict):
    """How a host is reached; ``via``: the host to jump through; ``declared``: which of `user` and `port` the
    spec sets."""

    address: str
    user: str
    port: int
    via: str | None
    declared: list[str]


class HostListState(TypedDict):
    """The list of a host, short: when it was written, and its digest."""

    epoch: int
    digest: str


class HostListNeeds(TypedDict):
    """The required keys of ``host_list``."""

    verb: Literal["host_list"]
    swarm: str


class HostListRequest(HostListNeeds, total=False):
    """The hosts of the swarm, as this host has stored them. With ``hosts`` this list takes its place if its
    ``epoch`` is larger; ``forgotten``: hosts that ``who`` left out of it, logged as the run ``txid``.
    ``wait``: s to wait for the lock."""

    hosts: dict[str, HostLogin]
    gone: dict[str, int]
    epoch: int
    who: str
    wait: float
    forgotten: list[str]
    txid: str


class HostListAnswer(TypedDict):
    """``epoch``: s since 1970, when an operator wrote the list; 0 without one; ``gone``: when hosts were
    taken off it."""

    epoch: int
    hosts: dict[str, HostLogin]
    gone: dict[str, int]
