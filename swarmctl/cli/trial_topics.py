"""The messages of topics while a trial goes on, and whether they show what ends it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import isfinite
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import yaml

from swarmctl.capsule.success import judge
from swarmctl.capsule.trajectory import RecordedTopic, Sample, planar
from swarmctl.cli.topic_host import error_of
from swarmctl.remote import host_commands
from swarmctl.remote.host_commands import MARK
from swarmctl.remote.parallel_hosts import Finished, Note, Stop, bugs_as_errors
from swarmctl.remote.transport import HostError, Kind, Target, Transport
from swarmctl.render.middleware import middleware_at, middleware_of
from swarmctl.render.topic_tool import END_OF_MESSAGE
from swarmctl.swarm.topic_island import full_name, island_of_topic

if TYPE_CHECKING:
    from swarmctl.spec.experiment_model import Criterion
    from swarmctl.swarm.resolved import Island, Swarm

_AGAIN = 1.0  # s until the next connection to a host that was lost
_LONGEST = 64 << 10  # characters of a message with a pose
_DEEPEST = 20  # levels of one
_CLOSEST = 0.1  # s between two poses that count
_SHARE = 9.0  # times as long as a look took, nobody looks again


class LiveTopics:
    """The topics of ``criteria`` from ``begin`` on; ``trouble``: why a host cannot show one."""

    def __init__(self, criteria: Sequence[Criterion]) -> None:
        self._criteria = criteria
        self._seen = {full_name(one.topic): RecordedTopic() for one in criteria}
        self._posed = {full_name(one.topic) for one in criteria if one.reached or one.distance is not None}
        self._lock = threading.Lock()
        self._due = 0.0
        self.trouble = ""

    def begin(self) -> None:
        """Forgets all messages until now."""
        with self._lock:
            self._seen = {name: RecordedTopic() for name in self._seen}

    @property
    def met(self) -> bool:
        """True once the messages show all of the criteria; never without one."""
        began = time.monotonic()
        if began < self._due:
            return False
        with self._lock:
            seen = {name: replace(one, samples=one.samples[:]) for name, one in self._seen.items()}
        judged = judge(self._criteria, seen)
        ended = time.monotonic()
        self._due = ended + _SHARE * (ended - began)
        return bool(judged) and all(one.met for one in judged)

    def add(self, name: str, text: str) -> None:
        """Takes a message of the topic ``name``, as the tool of ROS prints it in YAML, from a host."""
        now = time.monotonic()
        with self._lock:
            topic = self._seen[name]
            topic.messages += 1
            wanted = name in self._posed and not (topic.samples and now - topic.samples[-1].t < _CLOSEST)
        if not wanted:
            return
        try:
            message = _attributes(_loaded(text))
            sample = Sample(now, *_pose(message))
        except (yaml.YAMLError, AttributeError, TypeError, ValueError, OverflowError):
            return  # cut off, or of another kind: it counts all the same
        with self._lock:
            topic.odometry = hasattr(message, "child_frame_id")
            topic.samples.append(sample)


@contextmanager
def live(
    swarm: Swarm, criteria: Sequence[Criterion], targets: Mapping[str, Target], transport: Transport
) -> Iterator[LiveTopics]:
    """Yields the topics of ``criteria``, read on the hub of the island of each, until the block ends."""
    topics, stop = LiveTopics(criteria), Stop()
    for name in dict.fromkeys(full_name(one.topic) for one in criteria):
        arguments = swarm, name, topics, targets, transport, stop
        threading.Thread(target=_follow, args=arguments, daemon=True).start()
    try:
        yield topics
    finally:
        stop.request()
        stop.request()


def _follow(
    swarm: Swarm,
    name: str,
    topics: LiveTopics,
    targets: Mapping[str, Target],
    transport: Transport,
    stop: Stop,
) -> None:
    """Reads a topic, over another connection after each that is lost."""
    try:
        with bugs_as_errors(name):
            island = _island(swarm, name)
            middleware = middleware_of(island.distro)
            line = middleware.topic_tool.line(swarm.name, middleware.topic_tool.echo(name))
            if island.hub not in targets:
                raise HostError(Kind.UNREACHABLE, f"{island.hub}, where {name} is read, does not answer")
            while not stop.requested:
                events = host_commands.run(
                    [targets[island.hub]], line, transport, parallel=1, follow=True, stop=stop
                )
                text = ""
                for event in events:
                    if isinstance(event, Finished) and (ended := host_commands.ran(event)).error is None:
                        raise error_of(ended, swarm.name, middleware) or HostError(Kind.FAILED, "it ended")
                    if not isinstance(event, Note) or event.text.startswith(MARK):
                        continue
                    if event.text == END_OF_MESSAGE:
                        topics.add(name, text)
                        text = ""
                    elif len(text) <= _LONGEST:
                        text += f"{event.text}\n"
                time.sleep(_AGAIN)
    except HostError as error:
        topics.trouble = error.message


def _island(swarm: Swarm, topic: str) -> Island:
    """The island of a topic: that of its robot or of the program that publishes it, else the first."""
    publishing = (
        program
        for program in swarm.programs.values()
        if topic in dict(middleware_at(swarm, program.host).program(swarm, program).publishes)
    )
    hosts = [program.host for program in publishing]
    return island_of_topic(swarm, topic) or (swarm.island_of(hosts[0]) if hosts else swarm.islands[0])


def _loaded(text: str) -> Any:
    """The values in YAML from a host, which may be hostile. Raises ``YAMLError`` and ``ValueError``."""
    if len(text) > _LONGEST:
        raise ValueError("longer than a message with a pose")
    depth = 0
    for event in yaml.parse(text, yaml.CSafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if isinstance(event, yaml.AliasEvent) or depth > _DEEPEST:
            raise ValueError("no message of ROS")
    return yaml.load(text, yaml.CSafeLoader)


def _attributes(value: Any) -> Any:
    """The values of a message by attributes, as those of ROS."""
    if isinstance(value, dict):
        return SimpleNamespace(**{str(key): _attributes(one) for key, one in value.items()})
    return value


def _pose(message: Any) -> tuple[float, float, float]:
    """X, y and yaw of a message with a pose. Raises ``AttributeError``, ``ValueError`` and others."""
    while hasattr(message, "pose"):
        message = message.pose
    if hasattr(message, "theta"):
        found = float(message.x), float(message.y), float(message.theta)
    else:
        found = planar(message)
    if not all(map(isfinite, found)):
        raise ValueError("not a place")
    return found
