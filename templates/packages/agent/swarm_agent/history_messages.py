"""Requests and answers of ``history`` and ``rollback``; see ``messages``."""

from __future__ import annotations

from typing import Literal, TypedDict


class ChangeEntry(TypedDict):
    """One change of the host. ``time``: of its clock, s since 1970; ``run``: of swarmctl, ``who`` began it;
    ``prev`` and ``next``: releases, null for none; ``state``: applied or undone, for the reason ``error``."""

    time: float
    txid: str
    run: str
    who: str
    prev: str | None
    next: str | None
    state: str
    error: str


class HistoryRequest(TypedDict):
    """The last changes of the host."""

    verb: Literal["history"]
    swarm: str


class HistoryAnswer(TypedDict):
    """``entries``: the oldest first; ``release``: the current one; ``releases``: those that it could have
    again without a deploy; ``last``: the last transaction."""

    entries: list[ChangeEntry]
    release: str | None
    releases: list[str]
    last: str
