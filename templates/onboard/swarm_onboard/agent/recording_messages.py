"""Requests and answer of ``record`` and ``recording``; see ``messages``."""

from __future__ import annotations

from typing import Literal, TypedDict


class Graph(TypedDict):
    """Where a host finds the nodes of its island: the ``module`` that looks, and what it needs to know.

    ``homes``: the host by what may stand for it in the URI of a node, in lower case; ``nodes``: that of each
    node of the spec; ``awaited``: those of drivers, which a look waits for; ``declared``: the host that
    records each topic of the spec.
    """

    module: str
    master: str
    host: str
    hub: str
    homes: dict[str, str]
    nodes: dict[str, str]
    awaited: list[str]
    declared: dict[str, str]


class RecordRequest(TypedDict):
    """Record what nodes of this host publish that one of ``patterns`` matches (fnmatch(3)).

    ``account``: who runs ``command``, to which the topics are added; ``seconds``: for how long, 0 for ever.
    """

    verb: Literal["record"]
    swarm: str
    account: str
    command: list[str]
    patterns: list[str]
    graph: Graph
    seconds: float


class RecordingRequest(TypedDict):
    """How the recording is doing; ``stop`` ends it before."""

    verb: Literal["recording"]
    swarm: str
    stop: bool


#: Why a recording has ended; empty while it goes on, and if there never was one. ``lost``: its process is
#: gone, as after a power cut.
Ending = Literal["", "stopped", "time", "disk", "failed", "lost"]


class RecordingAnswer(TypedDict):
    """The last recording: whether it ``runs``, and since when, s since 1970 by the clock of the host.

    ``status`` and ``output``: exit status and last lines of a command that failed. ``bags``: the size in
    bytes of each file in the folder of bags, of this recording and of earlier ones. ``free``: bytes there.
    """

    runs: bool
    began: float
    topics: list[str]
    ended: Ending
    status: int
    output: str
    bags: dict[str, int]
    free: int
