"""The islands of ROS 1 with which this one is joined, in a loop in a thread of its own."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import threading
import time

from swarm_onboard.domain_relay.config import Config
from swarm_onboard.domain_relay.domains import Home, Topic, message_class
from swarm_onboard.domain_relay.publishers import Names
from swarm_onboard.domain_relay.ros1_island import Ros1Island

_BEAT = 0.5  # s
_LEAVES_WITHIN = 5.0  # s, less than a unit has to stop


class Masters:
    """``islands`` of ROS 1; ``topics`` of this one that go there, with the ``names`` of their publishers;
    ``looked``: when the loop last ran."""

    def __init__(self, config: Config, home: Home) -> None:
        self._loop = asyncio.new_event_loop()
        self.looked = time.monotonic()
        threading.Thread(target=self._loop.run_forever, name="masters", daemon=True).start()
        self.islands = asyncio.run_coroutine_threadsafe(self._start(config, home), self._loop).result()
        self.names = Names()
        self.topics = [
            Topic(one, message_class(one.type), home.node, island, self.names)
            for island in self.islands
            for one in island.sends.values()
        ]

    def leave(self) -> None:
        """Removes all registrations at the masters that answer in time."""
        leaving = asyncio.run_coroutine_threadsafe(self._leave(), self._loop)
        with contextlib.suppress(concurrent.futures.TimeoutError):
            leaving.result(_LEAVES_WITHIN)

    async def _start(self, config: Config, home: Home) -> list[Ros1Island]:
        islands = [Ros1Island(config, peer, home) for peer in config.ros1_peers]
        self._work = [asyncio.ensure_future(one.run()) for one in islands]
        self._beating = asyncio.ensure_future(self._beat())
        return islands

    async def _beat(self) -> None:
        """Runs while all islands are followed."""
        while not any(one.done() for one in self._work):
            self.looked = time.monotonic()
            await asyncio.sleep(_BEAT)

    async def _leave(self) -> None:
        for one in self._work:
            one.cancel()
        await asyncio.gather(*self._work, return_exceptions=True)
        await asyncio.gather(*(one.leave() for one in self.islands), return_exceptions=True)
