"""The state of a peer, as the relay reports it. Knows no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping, Sequence


@dataclass(frozen=True)
class PeerState:
    """``problem``: why the peer does not count as connected; empty if it does.

    ``unfit``: topics whose type cannot cross, each with the reason; ``refused``: as many lines about
    publishers that are not brought; ``senders``: the nodes that publish each topic, by topic and direction.
    """

    island: str
    problem: str
    unfit: Mapping[str, str]
    refused: Sequence[str]
    senders: Mapping[str, Sequence[str]]
