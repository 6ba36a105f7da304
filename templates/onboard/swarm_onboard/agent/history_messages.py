"""Requests and answers of ``history``, ``command_record`` and ``rollback``; see ``messages``."""

from __future__ import annotations

from typing import Literal, TypedDict


class ChangeEntry(TypedDict):
    """One change of the host. ``time``: of its clock, s since 1970; ``run``: of swarmctl, ``who`` began it;
    ``previous`` and ``next``: releases, null for none; ``previous_secrets`` and ``next_secrets``: the names
    of their sets of secrets; ``state``: applied; or undone, for the reason
    ``error``; or forgotten, with the names of hosts that left the swarm in ``error``."""

    time: float
    txid: str
    run: str
    who: str
    previous: str | None
    next: str | None
    previous_secrets: str
    next_secrets: str
    state: str
    error: str


class HistoryNeeds(TypedDict):
    """The required keys of ``history``."""

    verb: Literal["history"]
    swarm: str


class HistoryRequest(HistoryNeeds, total=False):
    """The last changes of the host. ``to``: a kept release and a set of secrets; the units that stop and
    start on the way there are wanted, too."""

    to: tuple[str, str]


class UnitsBack(TypedDict):
    """The units that a rollback stops, starts, restarts and reloads."""

    stop: list[str]
    start: list[str]
    restart: list[str]
    reload: list[str]


class HistoryAlways(TypedDict):
    """The required keys of the answer. ``entries``: the oldest first; ``release``: the current one, with the
    set ``secrets``; ``releases`` and ``secret_sets``: those that it could have again without a deploy;
    ``last``: the last transaction."""

    entries: list[ChangeEntry]
    release: str | None
    secrets: str
    releases: list[str]
    secret_sets: list[str]
    last: str


class HistoryAnswer(HistoryAlways, total=False):
    """``units``: with ``to`` only."""

    units: UnitsBack


class CommandRecordRequest(TypedDict):
    """Who commanded ``robot``; empty for the names of the robots alone."""

    verb: Literal["command_record"]
    swarm: str
    robot: str


class CommandRecordAnswer(TypedDict):
    """``robots``: those with a record on the host; ``text``: the lines of one (see ``record_chain``)."""

    robots: list[str]
    text: str
