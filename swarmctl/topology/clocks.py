"""Whose clock a swarm follows."""

from __future__ import annotations

from collections.abc import Sequence

from swarmctl.spec.model import Spec
from swarmctl.topology.swarm import Island


def time_root(spec: Spec, islands: Sequence[Island]) -> str | None:
    """The host whose clock the others follow: the one that is named, else the hub if there is just one."""
    if spec.time.root is not None:
        return spec.time.root
    return islands[0].hub if len(islands) == 1 else None
