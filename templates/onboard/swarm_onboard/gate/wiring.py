"""Which nodes are connected to a gate's topics, and what is wrong with that."""

from __future__ import annotations

import contextlib
import threading
import time
from dataclasses import dataclass, replace
from typing import Callable, Iterator, Mapping, Sequence, Tuple

from swarm_onboard.gate.config import Config

_MOST_NAMED = 3
_LOOK_EVERY = 2.0  # s

#: The publishers and the subscribers of each topic.
Ends = Mapping[str, Tuple[Sequence[str], Sequence[str]]]


@dataclass(frozen=True)
class Wiring:
    """Who receives the gate's commands, who else publishes there, who takes commands past the gate."""

    receivers: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    bypassing: tuple[str, ...] = ()

    def bypasses(self) -> Iterator[str]:
        """Yields a complaint for each way in which commands pass beside the gate."""
        if self.rivals:
            yield f"{_named(self.rivals)} publishes to the driver past the gate"
        if self.bypassing:
            yield f"{_named(self.bypassing)} takes commands past the gate: remap its command topic"


def wiring_of(ends: Ends, config: Config) -> Wiring:
    """Returns the wiring of a gate from the ends of its topics.

    A node that subscribes to the robot's commands from outside its namespace is no driver: it records them.
    """
    (_, commanded), (senders, receivers) = ends[config.command], ends[config.output]
    own = f"{config.namespace}/"
    others = [one for one in commanded if one != config.node]
    return Wiring(
        receivers=tuple(sorted(receivers)),
        rivals=tuple(sorted(one for one in senders if one != config.node)),
        bypassing=tuple(sorted(one for one in others if one.startswith(own))),
    )


def without_ended(wiring: Wiring, ended: Callable[[str], bool]) -> Wiring:
    """Returns the wiring without rivals that have ``ended``: the master lists a killed node for ever."""
    return replace(wiring, rivals=tuple(one for one in wiring.rivals if not ended(one)))


class WiringWatch:
    """Looks every two seconds who is connected to the gate's topics, in a thread of its own."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._latest: Wiring | None = None

    def latest(self) -> Wiring | None:
        """Returns what was seen last; None before that."""
        return self._latest

    def start(self, ends: Callable[[Sequence[str]], Ends], ended: Callable[[str], bool]) -> None:
        """Starts to look: ``ends`` returns those of some topics; ``ended``: whether a node is gone.

        Both may raise any error.
        """
        threading.Thread(target=self._watch, args=(ends, ended), name="wiring", daemon=True).start()

    def _watch(self, ends: Callable[[Sequence[str]], Ends], ended: Callable[[str], bool]) -> None:
        topics = (self._config.command, self._config.output)
        while True:
            with contextlib.suppress(Exception):  # a master that is away changes no connection
                self._latest = without_ended(wiring_of(ends(topics), self._config), ended)
            time.sleep(_LOOK_EVERY)


def _named(nodes: Sequence[str]) -> str:
    more = [f"{len(nodes) - _MOST_NAMED} more"] if len(nodes) > _MOST_NAMED else []
    return ", ".join([*nodes[:_MOST_NAMED], *more])
