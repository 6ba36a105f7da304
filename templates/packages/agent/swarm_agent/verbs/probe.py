"""``probe``: how the host's part of the swarm is doing, without changing or joining anything.

A part that fails does not affect the others: the answer has it in ``troubles``, with the reason.
"""

from __future__ import annotations

import asyncio
import glob
import grp
import os
import stat
import time
from typing import TYPE_CHECKING, Any, Callable, Mapping, Sequence

from swarm_common.xmlrpc import PeerError, place_of

from swarm_agent import systemd
from swarm_agent.errors import RefusedError
from swarm_agent.release_store import home_of
from swarm_agent.rpc import Report
from swarm_agent.verbs import probe_graph
from swarm_agent.verbs import probe_ros as ros
from swarm_agent.verbs.probe_ros import clipped

if TYPE_CHECKING:
    from swarm_agent.messages import GraphRequest, NodeRequest, ProbeAnswer, ProbeRequest

LONGEST_LISTENING = 15.0  # s for one topic
_CALLS = 4 * ros.CALL_SECONDS  # the calls that come one after the other before and after the listening
_MOST_NODES = 200
_MOST_TOPICS = 20  # of one node
_MOST_NAMES = 20  # publishers of one topic, adapters on one host
_MOST_SENDERS = 400  # nodes that publish on the topics that command robots
_DIAGNOSTICS = "/diagnostics"
_SERIAL_GROUP = "dialout"


def handle(request: ProbeRequest, payload: bytes, report: Report) -> ProbeAnswer:
    home = home_of(request["swarm"])
    answer: ProbeAnswer = {"troubles": {}}

    def part(name: str, find: Callable[[], Any]) -> Any:
        try:
            return find()
        except RefusedError as error:
            answer["troubles"][name] = clipped(error.message, 300)
        except Exception as error:  # noqa: BLE001  (whatever it is, it must not take the other parts' answers away)
            answer["troubles"][name] = clipped(f"{type(error).__name__}: {error}")
        return None

    def states() -> dict[str, Any]:
        return systemd.states([str(unit) for unit in request["units"]])

    before = part("units", states)
    answer["release"] = part("release", home.current)
    answer["devices"] = part("devices", lambda: {path: device(path) for path in request["devices"]})
    part("ros", lambda: asyncio.run(_probe_ros(request, answer)))
    answer["units"] = _with_restarts(before, part("units", states))
    answer["boot_id"] = part("boot_id", _boot_id)
    answer["time"] = time.time()
    return answer


def _with_restarts(
    before: Mapping[str, Any] | None, after: Mapping[str, Any] | None
) -> dict[str, Any] | None:
    """The states of now, with how often each unit was restarted while the probe looked."""
    if before is None or after is None:
        return None
    return {
        unit: {**state, "restarted": max(0, state["restarts"] - before[unit]["restarts"])}
        for unit, state in after.items()
    }


def _boot_id() -> str:
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
        return file.read().strip()


def device(path: str) -> dict[str, Any]:
    """Whether a serial device is there and open to drivers; where it is not, what else is."""
    try:
        status = os.stat(path)
    except OSError as error:
        nearby = sorted(os.path.basename(one) for one in glob.glob("/dev/serial/by-id/*"))
        return {
            "exists": False,
            "error": error.strerror,
            "nearby": [clipped(one) for one in nearby[:_MOST_NAMES]],
        }
    try:
        group = grp.getgrgid(status.st_gid).gr_name
    except KeyError:
        group = str(status.st_gid)
    return {
        "exists": True,
        "resolves": os.path.realpath(path),
        "is_device": stat.S_ISCHR(status.st_mode),
        "usable": group == _SERIAL_GROUP and status.st_mode & 0o060 == 0o060,
        "group": group,
        "mode": stat.S_IMODE(status.st_mode),
    }


async def _probe_ros(request: ProbeRequest, answer: ProbeAnswer) -> None:
    """Fill in the answers of master and nodes; keeps what has arrived when the time is up."""
    longest = max(
        (_seconds(one) for node in request["nodes"] for one in node["topics"].values()), default=0.0
    )
    answer["nodes"], answer["commanders"], answer["senders"] = {}, {}, {}
    try:
        await asyncio.wait_for(_master_and_nodes(request, answer), longest + 2 * _CALLS)
    except asyncio.TimeoutError:
        answer["troubles"]["ros"] = "master and nodes took too long to answer"


def _seconds(value: Any) -> float:
    return min(max(0.0, float(value)), LONGEST_LISTENING)


async def _master_and_nodes(request: ProbeRequest, answer: ProbeAnswer) -> None:
    uri = str(request["master"])
    answer["master"] = await master(uri)
    if not answer["master"]["reachable"]:
        return
    works = [_node(uri, one, answer["nodes"]) for one in request["nodes"][:_MOST_NODES]]
    if request["commands"]:
        works.append(_commanders(uri, request["commands"], answer))
    bridged = request.get("graph")
    if bridged:
        works.append(_graph(uri, bridged, answer))
    await asyncio.gather(*works)


async def master(uri: str) -> dict[str, Any]:
    """Whether a ROS master answers, how fast, and which run of it: two hosts must see the same."""
    began = time.monotonic()
    try:
        pid = await ros.call(uri, "getPid")
        latency = time.monotonic() - began
        run_id = await ros.call(uri, "getParam", "/run_id")
    except PeerError as error:
        return {"reachable": False, "error": str(error)}
    return {
        "reachable": True,
        "pid": pid if isinstance(pid, int) else 0,
        "run_id": clipped(run_id),
        "latency": latency,
    }


async def _commanders(uri: str, topics: Sequence[str], answer: ProbeAnswer) -> None:
    """Who publishes on each of ``topics``, as the master has it."""
    try:
        publishers = (await ros.call(uri, "getSystemState", seconds=3 * ros.CALL_SECONDS))[0]
        found = {
            str(topic): [clipped(name) for name in sorted(names)[:_MOST_NAMES]] for topic, names in publishers
        }
    except PeerError as error:
        answer["troubles"]["commanders"] = str(error)
    except (TypeError, ValueError, LookupError):
        answer["troubles"]["commanders"] = "the master's system state makes no sense"
    else:
        answer["commanders"] = {topic: found.get(topic, []) for topic in topics}
        senders = {name for names in answer["commanders"].values() for name in names}
        works = (_sender(uri, name, topics, answer["senders"]) for name in sorted(senders)[:_MOST_SENDERS])
        await asyncio.gather(*works)


async def _sender(master_uri: str, name: str, topics: Sequence[str], answers: dict[str, Any]) -> None:
    """Where a node that commands runs, and which of ``topics`` it publishes as what: none if it is gone."""
    found: dict[str, Any] = {"host": "", "publishes": {}}
    try:
        uri = str(await ros.call(master_uri, "lookupNode", name))
        found["host"] = clipped(place_of(uri)[0])
        publishes = _types(await ros.call(uri, "getPublications"))
    except PeerError as error:
        found["error"] = str(error)
    else:
        found["publishes"] = {topic: kind for topic, kind in publishes.items() if topic in topics}
    answers[name] = found


async def _graph(uri: str, asked: GraphRequest, answer: ProbeAnswer) -> None:
    try:
        answer["graph"] = await probe_graph.look(uri, asked)
    except PeerError as error:
        answer["troubles"]["graph"] = str(error)


async def _node(master_uri: str, asked: NodeRequest, answers: dict[str, Any]) -> None:
    """One node: whether it is registered and alive, its topics, and their rates."""
    name = str(asked["name"])
    found: dict[str, Any] = {"registered": None, "alive": None, "error": "", "topics": {}}
    answers[name] = found
    try:
        uri = str(await ros.call(master_uri, "lookupNode", name))
    except PeerError as error:
        found.update(registered=False, error=str(error))
        return
    found.update(registered=True, uri=clipped(uri))
    try:
        pid, publications, subscriptions = await asyncio.gather(
            ros.call(uri, "getPid"), ros.call(uri, "getPublications"), ros.call(uri, "getSubscriptions")
        )
        found.update(pid=pid if isinstance(pid, int) else 0, alive=True)
        found.update({"publishes": _types(publications), "subscribes": _types(subscriptions)})
    except PeerError as error:
        found.update(alive=False, error=str(error))
        return
    topics = list(asked["topics"].items())[:_MOST_TOPICS]
    await asyncio.gather(*(_topic(uri, topic, _seconds(seconds), found) for topic, seconds in topics))


def _types(pairs: Any) -> dict[str, str]:
    try:
        return {clipped(topic): clipped(kind) for topic, kind in pairs[:200]}
    except (TypeError, ValueError):
        raise PeerError("its list of topics makes no sense") from None


async def _topic(uri: str, topic: str, seconds: float, node: dict[str, Any]) -> None:
    flow = ros.Flow(seconds)
    entry: dict[str, Any] = {"count": 0, "rate": None, "seconds": seconds, "type": "", "error": ""}
    node["topics"][topic] = entry
    try:
        await ros.listen(uri, topic, flow, keep_first=topic == _DIAGNOSTICS)
        if flow.first_body:
            node["reports"] = ros.diagnostics_in(flow.first_body)
    except PeerError as error:
        entry["error"] = str(error)
    entry.update(count=flow.count, rate=flow.rate(time.monotonic()), type=flow.type)
