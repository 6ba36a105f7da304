"""The terms under which a robot may be changed: its own, and those of the swarm where it has none. Pure."""

from __future__ import annotations

from swarmctl.spec.model import Maintenance, Spec


def maintenance_of(spec: Spec, robot: str) -> Maintenance:
    """Returns the terms that hold for ``robot``; a term that asks for nothing is None."""
    layers = (spec.maintenance, spec.robots[robot].maintenance)
    set_ones = [one.model_dump(exclude_none=True) for one in layers]
    return Maintenance(**{key: value for key, value in {**set_ones[0], **set_ones[1]}.items() if value})
