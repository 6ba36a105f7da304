"""What a page may ask for with ``--control``: to stop robots, and to release them."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from swarmctl.deploy import robot_stop
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Target, Transport
from swarmctl.views import robot_stop as view

_PARALLEL = 256  # hosts at the same time


class Control:
    """Stops and releases the robots of a swarm. ``hosts``: the host of each robot."""

    def __init__(
        self, swarm: str, hosts: Mapping[str, str], targets: Mapping[str, Target], transport: Transport
    ) -> None:
        self._swarm, self._hosts = swarm, hosts
        self._targets, self._transport = targets, transport

    def do(self, action: str, robots: Sequence[str]) -> Iterator[str]:
        """Does ``stop`` or ``start`` with these robots, all without any. Yields a line for each result."""
        chosen: dict[str, list[str]] = {}
        for robot in robots or self._hosts:
            if robot in self._hosts:
                chosen.setdefault(self._hosts[robot], []).append(robot)
        if action == "stop":
            yield from self._stop(chosen, others=not robots)
        elif action == "start":
            yield from self._start(chosen, others=not robots)

    def _stop(self, chosen: Mapping[str, Sequence[str]], *, others: bool) -> Iterator[str]:
        began = time.monotonic()
        events = robot_stop.stop(
            self._swarm, chosen, self._targets, self._transport, lambda: time.monotonic() - began,
            others=others, parallel=_PARALLEL,
        )  # fmt: skip
        for event in events:
            if isinstance(event, Finished):
                for one in robot_stop.robot_stops(event.host, chosen[event.host], event.outcome):
                    yield view.line(one).plain

    def _start(self, chosen: Mapping[str, Sequence[str]], *, others: bool) -> Iterator[str]:
        events: Any = robot_stop.start(
            self._swarm, chosen, self._targets, self._transport, others=others, parallel=_PARALLEL
        )
        for event in events:
            if isinstance(event, Finished):
                result = event.outcome
                if isinstance(result, HostError):
                    yield f"{event.host}  {result.kind.value}: {result.message}"
                else:
                    for name in result.released:
                        yield f"{name}  released: it stands until its next command"
