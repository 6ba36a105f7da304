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
    graph = request["graph"]
    published: list[str] = importlib.import_module(graph["module"]).published(graph)
    matching = {one for one in published if any(fnmatchcase(one, shape) for shape in request["patterns"])}
    topics = sorted({*request["topics"], *matching})
    if not topics:
        return {**before, "topics": [], "ended": ""}
    report.detach()
    bags.start(home, request["account"], float(request["seconds"]), request["command"], topics)
    return bags.wait_until_written(home, list(before["bags"]), _BEGINS_WITHIN)
