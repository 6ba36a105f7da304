"""``record``: records topics in bags on this host, until ``recording`` stops it."""

from __future__ import annotations

import importlib
import time
from fnmatch import fnmatchcase

from swarm_onboard.agent import accounts, bags
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import AbstractSet, Mapping

    from swarm_onboard.agent.recording_messages import RecordingAnswer, RecordRequest

_BEGINS_WITHIN = 15.0  # s


def handle(request: RecordRequest, payload: bytes, report: Report) -> RecordingAnswer:
    """Starts the recording, if nodes of this host publish something of it. Raises ``RefusedError``."""
    home = home_of(request["swarm"])
    if not accounts.NAME.fullmatch(request["account"]):
        raise RefusedError(f"{request['account']!r} is not a name of an account")
    before = bags.state(home)
    if before["runs"]:
        since = time.strftime("%H:%M:%S", time.localtime(before["began"]))
        raise RefusedError(
            f"a recording runs here since {since}",
            "`swarmctl record SPEC --fetch` ends it, and fetches its bags",
        )
    published = importlib.import_module(request["graph"]["module"]).published(request)
    topics = topics_here(request, published)
    if not topics:
        return {**before, "topics": [], "ended": ""}
    report.detach()
    bags.start(home, request["account"], float(request["seconds"]), request["command"], topics)
    return bags.wait_until_written(home, list(before["bags"]), _BEGINS_WITHIN)


def topics_here(request: RecordRequest, published: Mapping[str, AbstractSet[str]]) -> list[str]:
    """Returns what this host records: topics of the spec, and those that its nodes alone publish.

    ``published``: the hosts of each topic, an empty text for one that is unknown. The hub records topics of
    several hosts, and of unknown ones.
    """
    graph = request["graph"]
    hosts = {**published, **{topic: {host} for topic, host in graph["declared"].items()}}
    matching = {one for one in hosts if any(fnmatchcase(one, shape) for shape in request["patterns"])}
    return sorted(one for one in matching if _recorded_on(hosts[one], graph["hub"]) == graph["host"])


def _recorded_on(hosts: AbstractSet[str], hub: str) -> str:
    return (next(iter(hosts)) if len(hosts) == 1 else "") or hub
