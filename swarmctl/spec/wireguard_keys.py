"""NAME.wireguard beside a spec: the public WireGuard keys of its hosts, as `swarmctl trust` pins them.

It has the lines of ``swarm_onboard.tunnel.keys``; others in it stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarmctl.spec.model import Spec


def paths(spec: Spec) -> Iterator[str]:
    """Yields the file of a sealed swarm, from the folder of the spec."""
    if spec.has_wireguard:
        yield path(spec.name)


def path(swarm: str) -> str:
    """Returns the name of the file."""
    return f"{swarm}.wireguard"


def text_of(content: bytes) -> str:
    """Returns the content as text that ``bytes_of`` makes the same content of, whatever it is."""
    return content.decode(errors="surrogateescape")


def bytes_of(text: str) -> bytes:
    """Returns the text as it stands in the file."""
    return text.encode(errors="surrogateescape")
