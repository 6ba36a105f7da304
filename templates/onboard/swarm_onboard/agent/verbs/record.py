"""``record``: records topics in bags on this host, until ``recording`` stops it."""

from __future__ import annotations

import importlib
import time
from fnmatch import fnmatchcase

from swarm_onboard.agent import accounts, bags
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import AbstractSet, Mapping

_BEGINS_WITHIN = 15.0  # s


class Request(NamedTuple):
    """Record what nodes of this host publish that one of ``patterns`` matches (fnmatch(3)).

    ``account``: who runs ``command``, to which the topics are added; ``seconds``: for how long, 0 for ever.
    ``module`` finds the nodes of the island. ``homes``: the host by what may stand for it in the URI of a
    node, in lower case; ``nodes``: that of each node of the spec; ``awaited``: those of drivers, which a look
    waits for; ``declared``: the host that records each topic of the spec.
    """

    swarm: str
    account: str
    command: list[str]
    patterns: list[str]
    seconds: float
    module: str
    master: str
    host: str
    hub: str
    homes: dict[str, str]
    nodes: dict[str, str]
    awaited: list[str]
    declared: dict[str, str]


Answer = bags.Recording


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Starts the recording, if nodes of this host publish something of it. Raises ``RefusedError``."""
    home = home_of(request.swarm)
    if not accounts.NAME.fullmatch(request.account):
        raise RefusedError(f"{request.account!r} is not a name of an account")
    before = bags.state(home)
    if before.runs:
        since = time.strftime("%H:%M:%S", time.localtime(before.began))
        raise RefusedError(
            f"a recording runs here since {since}",
            "`swarmctl record SPEC --fetch` ends it, and fetches its bags",
        )
    published = importlib.import_module(request.module).published(request)
    topics = topics_here(request, published)
    if not topics:
        return before._replace(topics=[], ended="")
    report.detach()
    bags.start(home, request.account, float(request.seconds), request.command, topics)
    return bags.wait_until_written(home, list(before.bags), _BEGINS_WITHIN)


def topics_here(request: Request, published: Mapping[str, AbstractSet[str]]) -> list[str]:
    """Returns what this host records: topics of the spec, and those that its nodes alone publish.

    ``published``: the hosts of each topic, an empty text for one that is unknown. The hub records topics of
    several hosts, and of unknown ones.
    """
    hosts = {**published, **{topic: {host} for topic, host in request.declared.items()}}
    matching = {one for one in hosts if any(fnmatchcase(one, shape) for shape in request.patterns)}
    return sorted(one for one in matching if _recorded_on(hosts[one], request.hub) == request.host)


def _recorded_on(hosts: AbstractSet[str], hub: str) -> str:
    return (next(iter(hosts)) if len(hosts) == 1 else "") or hub
