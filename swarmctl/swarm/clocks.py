"""Which host's clock each host follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swarmctl.spec.model import Spec
from swarmctl.swarm.resolved import Island, Swarm


def time_root(spec: Spec, islands: Sequence[Island]) -> str | None:
    """Returns the host whose clock the others follow: `time.root`, else the hub if there is one island."""
    if spec.time.root is not None:
        return spec.time.root
    return islands[0].hub if len(islands) == 1 else None


def followed(swarm: Swarm) -> Mapping[str, str]:
    """By host, the host whose clock it follows: the time root, or its island's hub if there is no root.

    A host that follows no other host is not a key.
    """
    return {
        host: root
        for island in swarm.islands
        for root in (swarm.time.root or island.hub,)
        for host in island.hosts
        if host != root
    }
