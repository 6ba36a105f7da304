"""Whose clock a swarm follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swarmctl.spec.model import Spec
from swarmctl.topology.swarm import Island, Swarm


def time_root(spec: Spec, islands: Sequence[Island]) -> str | None:
    """The host whose clock the others follow: the one that is named, else the hub if there is just one."""
    if spec.time.root is not None:
        return spec.time.root
    return islands[0].hub if len(islands) == 1 else None


def followed(swarm: Swarm) -> Mapping[str, str]:
    """By host whose clock it follows: the root's, or its hub's where several islands have no root in common.

    Whom nobody follows, and who follows nobody, is not in it.
    """
    return {
        host: root
        for island in swarm.islands
        for root in (swarm.time.root or island.hub,)
        for host in island.hosts
        if host != root
    }
