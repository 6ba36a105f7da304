"""The terms under which a robot may be changed: its own, and those of the swarm where it has none. Pure.

A gate measures `battery` and `docked` by topics of the driver.
"""

from __future__ import annotations

from collections.abc import Iterable

from swarmctl.spec.model import NO_TERMS, Maintenance, Spec
from swarmctl.swarm.topics import MESSAGES, DriverTopic


def maintenance_of(spec: Spec, robot: str) -> Maintenance:
    """Returns the terms that hold for ``robot``; a term that asks for nothing is None."""
    layers = [one for one in (spec.maintenance, spec.robots[robot].maintenance) if one is not NO_TERMS]
    wanted = {key: value for one in layers for key, value in one.model_dump(exclude_none=True).items()}
    return Maintenance(**{key: value for key, value in wanted.items() if value}) if wanted else NO_TERMS


def power_topics(topics: Iterable[DriverTopic]) -> tuple[str | None, str | None]:
    """Returns the topics of a driver with its robot's battery, and with whether it is docked."""
    found = [(one.name, one.type) for one in topics]
    battery = next((name for name, kind in found if kind == MESSAGES["battery"]), None)
    docked = (name for name, kind in found if kind == "std_msgs/Bool" and name.split("/")[-1] == "docked")
    return battery, next(docked, None)
