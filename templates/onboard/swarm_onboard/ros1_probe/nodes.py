"""A node of a ROS 1 graph: whether it is registered and answers, its services, its topics and their rates.

The master asks a registered node to end when another one registers under its name
(rosmaster/registrations.py), with a reason that rospy, roscpp and swarmctl's drivers log; the latter go on.
"""

from __future__ import annotations

import asyncio
import re
import time
from typing import TYPE_CHECKING, AbstractSet, Any, AsyncIterator, Iterable, Iterator, Mapping, Sequence

from swarm_onboard.agent import unit_journal
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.observations import ConflictSeen, NodeSeen, Status, TopicSeen, worst
from swarm_onboard.agent.texts import clipped
from swarm_onboard.common.xmlrpc import PeerError
from swarm_onboard.ros1_probe import client

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Answer


Providers = Mapping[str, Sequence[str]]  # the nodes that provide each service

LONGEST_LISTENING = 15.0  # s for one topic
LATE = 4.0  # s until a node publishes all: a board that is reset as its port opens has topics after 2-3 s
_LOOK_EVERY = 0.25  # s
_MOST_TOPICS = 20  # of one node
_MOST_PARAMETERS = 20  # of one node, in words
_DIAGNOSTICS = "/diagnostics"
_GOALS, _GOAL = "/goal", "ActionGoal"  # how the topic with the goals of an action ends, and its type


async def look(
    master_uri: str,
    name: str,
    topics: Mapping[str, float],
    providers: Providers,
    parameters: Mapping[str, Any] | None = None,
    *,
    published_only: bool = False,
) -> AsyncIterator[NodeSeen]:
    """Yields one node as it gets known: whether it is registered and alive, its services and topics, and the
    rates of these.

    ``topics``: with the s to listen to each; ``published_only``: leave out those that it does not publish.
    """
    try:
        uri = str(await client.call(master_uri, "lookupNode", name))
    except client.FailedCallError as error:
        yield NodeSeen(False, error=str(error))
        return
    except PeerError as error:  # the master is silent: nothing is known of the node
        yield NodeSeen(error=str(error))
        return
    provides = {service: "" for service, nodes in providers.items() if name in nodes}
    found = NodeSeen(True, uri=clipped(uri), provides=provides)
    yield found
    try:
        pid, publications, subscriptions = await asyncio.gather(
            client.call(uri, "getPid"),
            _publications(uri, set() if published_only else set(topics)),
            client.call(uri, "getSubscriptions"),
        )
        found = found._replace(
            alive=True,
            pid=process_of(pid),
            publishes=publications,
            subscribes=types_of(subscriptions),
        )
    except PeerError as error:
        yield found._replace(alive=False, error=str(error))
        return
    found = found._replace(provides={**provides, **dict(_actions(found.subscribes))})
    yield found
    wanted = [one for one in topics.items() if not published_only or one[0] in found.publishes]
    set_otherwise, measured = await asyncio.gather(
        _parameters(master_uri, name, parameters),
        asyncio.gather(
            *(_topic(uri, topic, seconds_of(listening)) for topic, listening in wanted[:_MOST_TOPICS])
        ),
    )
    yield found._replace(
        parameters=set_otherwise,
        topics={topic: seen for (topic, _), (seen, _) in zip(wanted, measured)},
        report=worst([status for _, statuses in measured for status in statuses]),
    )


async def _publications(uri: str, wanted: AbstractSet[str]) -> Mapping[str, str]:
    """The types of what a node publishes, once ``wanted`` are among it or have not come in time."""
    end = time.monotonic() + LATE
    while True:
        found = types_of(await client.call(uri, "getPublications"))
        if wanted <= found.keys() or time.monotonic() >= end:
            return found
        await asyncio.sleep(_LOOK_EVERY)


def goals_of(action: str) -> str:
    """The topic with the goals of an action."""
    return f"{action}{_GOALS}"


def _actions(subscribes: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yields the actions of a node with their types: each has a topic for its goals."""
    for topic, kind in subscribes.items():
        if topic.endswith(_GOALS) and kind.endswith(_GOAL):
            package, _, name = kind[: -len(_GOAL)].partition("/")
            yield topic[: -len(_GOALS)], f"{package}/action/{name}"


async def _parameters(master_uri: str, node: str, wanted: Mapping[str, Any] | None) -> Sequence[str] | None:
    """Compares the parameters that a node has set with those that the master has, if it answers."""
    if not wanted:
        return None
    try:
        seen = await client.call(master_uri, "getParam", node)
    except client.FailedCallError:
        seen = {}
    except PeerError:  # the master is silent
        return None
    return list(_differences(wanted, seen))[:_MOST_PARAMETERS]


def _differences(wanted: Mapping[str, Any], seen: Any, above: str = "") -> Iterator[str]:
    for name, value in wanted.items():
        path = f"{above}{name}"
        if not isinstance(seen, dict) or name not in seen:
            yield f"{path} is not set"
        elif isinstance(value, dict):
            yield from _differences(value, seen[name], f"{path}/")
        elif seen[name] != value:
            yield clipped(f"{path} is {seen[name]!r} instead of {value!r}")


def seconds_of(value: Any) -> float:
    """A time to listen, s, within bounds."""
    return min(max(0.0, float(value)), LONGEST_LISTENING)


def process_of(value: Any) -> int:
    """A process number as a node or a master returns it; 0 if it is none."""
    return value if type(value) is int and 0 < value < 1 << 31 else 0


def types_of(pairs: Any) -> dict[str, str]:
    """The type by topic, in what a node returns for its publications. Raises ``PeerError``."""
    try:
        return {clipped(topic): clipped(kind) for topic, kind in pairs[:200]}
    except (TypeError, ValueError):
        raise PeerError("its list of topics makes no sense") from None


async def _topic(uri: str, topic: str, seconds: float) -> tuple[TopicSeen, list[Status]]:
    flow = client.Flow(seconds)
    problem = ""
    statuses: list[Status] = []
    try:
        await client.listen(uri, topic, flow, keep_first=topic == _DIAGNOSTICS)
        if flow.first_body:
            statuses = client.diagnostics_in(flow.first_body)
    except PeerError as error:
        problem = str(error)
    now = time.monotonic()
    seen = TopicSeen(flow.count, flow.rate(now), flow.seconds, flow.type, problem, flow.age(now))
    return seen, statuses


_OF_PYTHON = "shutdown request: "  # begins that line of rospy and of the drivers
_TAKEN = "Reason: new node registered with same name"
_REASON = re.compile(rf"\[(/[^\]\s]+)\] {_TAKEN}")
_MOST_UNITS = 20  # whose logs are read
_LONGEST = 10.0  # s for all logs


def added(answer: Answer) -> Answer:
    """Returns the answer with the conflicts of units that logged one, were restarted, do not run, or have
    lost a node.

    The states of the units are the last ones of the probe: one that was ended during it counts, too.
    """
    began = time.monotonic()
    conflicts = {}
    trouble = ""
    try:
        for unit, since in _suspicious(answer)[:_MOST_UNITS]:
            if time.monotonic() - began > _LONGEST:
                trouble = "the logs of the units took too long to read"
                break
            found = conflicts_in(unit_journal.messages(unit, since), time.time())
            if found:
                conflicts[unit] = found
    except RefusedError as error:
        trouble = clipped(error.message)
    troubles = {**answer.troubles, "conflicts": trouble} if trouble else answer.troubles
    return answer._replace(conflicts=conflicts, troubles=troubles)


def _suspicious(answer: Answer) -> list[tuple[str, float]]:
    """Units to look at, each with the time from which on its log counts. Raises RefusedError."""
    since = min(answer.since.values(), default=0.0)
    requested = unit_journal.units_with([f"{_OF_PYTHON}[{node}] {_TAKEN}" for node in answer.nodes], since)
    lost = {
        unit for unit, one in answer.launched.items() if one.ended or max(one.starts.values(), default=1) > 1
    }
    return [
        (unit, answer.since[unit])
        for unit, state in answer.units.items()
        if unit in answer.since
        and (unit in requested or unit in lost or state.restarted or state.active != "active" or state.recent)
    ]


def conflicts_in(lines: Iterable[unit_journal.Message], now: float) -> dict[str, ConflictSeen]:
    """How often each node was ended by another of its name, and how long before ``now``, s."""
    found: dict[str, ConflictSeen] = {}
    for line in lines:
        match = _REASON.search(line.text)
        if match:
            name = clipped(match.group(1))
            count = found[name].count if name in found else 0
            found[name] = ConflictSeen(count + 1, max(0.0, now - line.time))
    return found
