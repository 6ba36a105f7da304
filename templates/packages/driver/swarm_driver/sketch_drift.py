"""Where a sketch differs from what its robot's type says of it. Pure."""

from __future__ import annotations

from typing import Sequence

from swarm_rosserial.conversation import Negotiated
from swarm_rosserial.messages import TWIST_TYPE

from swarm_driver.protocols import RosserialProtocol

_MOST_NAMED = 3


class Drift:
    """What a sketch announced last, held against what is known of it."""

    def __init__(self, protocol: RosserialProtocol) -> None:
        self._protocol = protocol
        self._found: list[str] = []
        self._refused: dict[str, str] = {}

    def negotiated(self, event: Negotiated) -> None:
        self._refused = {one.name: one.reason for one in event.refusals}
        said = {(one.name, one.published): one.type for one in event.topics}
        known = {(name, True): kind for name, kind in self._protocol.publishes.items()}
        known |= {(name, False): kind for name, kind in self._protocol.subscribes.items()}
        missing = [key for key in known if key not in said and key[0] not in self._refused]
        strange = [key for key in said if key not in known]
        other = [key for key in said if key in known and said[key] != known[key]]
        self._found = [
            *self._refused.values(),
            *_described("the sketch does not {} {}, as its type declares", missing),
            *_described("the sketch does {} {}, which its type does not declare", strange),
            *(
                f"`{name}` is {said[name, way]}, not {known[name, way]} as the type declares"
                for name, way in other
            ),
        ]

    def why_not(self, name: str, types: Sequence[str]) -> str:
        """Why the sketch cannot be sent ``name``, to which it subscribes as these types."""
        if types:
            return f"the sketch subscribes to `{name}` as {' and '.join(types)}, not once as {TWIST_TYPE}"
        return self._refused.get(name, f"the sketch does not subscribe to `{name}`")

    def complaints(self, firmware: str) -> list[str]:
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
