"""The terms under which a robot may be changed: its own, and those of the swarm where it has none. Pure."""

from __future__ import annotations

from swarmctl.spec.model import NO_TERMS, Maintenance, Spec


def maintenance_of(spec: Spec, robot: str) -> Maintenance:
    """Returns the terms that hold for ``robot``; a term that asks for nothing is None."""
    layers = [one for one in (spec.maintenance, spec.robots[robot].maintenance) if one is not NO_TERMS]
    wanted = {key: value for one in layers for key, value in one.model_dump(exclude_none=True).items()}
    return Maintenance(**{key: value for key, value in wanted.items() if value}) if wanted else NO_TERMS
