"""Request and answer of ``logs``; see ``messages``."""

from __future__ import annotations

from typing import Literal, TypedDict


class LogsRequest(TypedDict):
    """What units have logged: the last ``lines`` since ``since``, of the host's clock in s since 1970.

    ``parts``: the first parts of their names, such as robots; empty for all units of the swarm.
    ``follow``: for how long, in s, entries after the cursor ``after`` (else since ``since``) are sent as
    notes, each the JSON of an answer.
    """

    verb: Literal["logs"]
    swarm: str
    parts: list[str]
    lines: int
    since: float
    after: str
    follow: float


class LogEntry(TypedDict):
    """``time``: of the host's clock, s since 1970; ``priority``: of syslog(3)."""

    time: float
    unit: str
    priority: int
    message: str


class LogsAnswer(TypedDict):
    """``clock``: of the host as it began, s since 1970; ``entries``: the oldest first; ``cursor``: of the
    last one, empty without any; ``cut``: there are more."""

    clock: float
    entries: list[LogEntry]
    cursor: str
    cut: bool
