"""Differences between what a sketch announces and what its robot type declares. Pure."""

from __future__ import annotations

from typing import Sequence

from swarm_onboard.driver.protocols import RosserialProtocol
from swarm_onboard.rosserial.conversation import Negotiated
from swarm_onboard.rosserial.messages import TWIST_TYPE

_MOST_NAMED = 3


class Drift:
    """The latest announcement of a sketch, compared with its robot type."""

    def __init__(self, protocol: RosserialProtocol) -> None:
        self._protocol = protocol
        self._found: list[str] = []
        self._refused: dict[str, str] = {}

    def negotiated(self, event: Negotiated) -> None:
        """Compares a new announcement with the type."""
        self._refused = {one.name: one.reason for one in event.refusals}
        announced = {(one.name, one.published): one.type for one in event.topics}
        known = {(name, True): kind for name, kind in self._protocol.publishes.items()}
        known |= {(name, False): kind for name, kind in self._protocol.subscribes.items()}
        missing = [key for key in known if key not in announced and key[0] not in self._refused]
        strange = [key for key in announced if key not in known]
        other = [key for key in announced if key in known and announced[key] != known[key]]
        self._found = [
            *self._refused.values(),
            *_described("the sketch does not {} {}, as its type declares", missing),
            *_described("the sketch does {} {}, which its type does not declare", strange),
            *(
                f"`{name}` is {announced[name, way]}, not {known[name, way]} as the type declares"
                for name, way in other
            ),
        ]

    def why_not(self, name: str, types: Sequence[str]) -> str:
        """Returns why the sketch cannot be sent ``name``, to which it subscribes as these types."""
        if types:
            return f"the sketch subscribes to `{name}` as {' and '.join(types)}, not once as {TWIST_TYPE}"
        return self._refused.get(name, f"the sketch does not subscribe to `{name}`")

    def complaints(self, firmware: str) -> list[str]:
        """Returns the differences, as text for people."""
        wanted = self._protocol.firmware
        if wanted and firmware != wanted:
            other = f"the sketch is {firmware}, the spec makes {wanted}"
            return [f"{other}: `swarmctl firmware flash` brings it", *self._found]
        return self._found


def _described(sentence: str, topics: list[tuple[str, bool]]) -> list[str]:
    return [
        sentence.format(verb, ", ".join(f"`{name}`" for name in names[:_MOST_NAMED]))
        for verb, way in (("publish", True), ("subscribe to", False))
        if (names := [name for name, published in topics if published is way])
    ]
