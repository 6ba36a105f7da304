"""Which topics cross between islands: what `control` and the programs need, and what the spec names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from swarmctl.spec.model import Spec
from swarmctl.topology import modes, names
from swarmctl.topology.interfaces import COMMAND, COMMAND_TYPE, SENSORS, Endpoint, program_host
from swarmctl.topology.swarm import Bridge, Island


def bridges_of(spec: Spec, islands: Sequence[Island], endpoints: Sequence[Endpoint]) -> tuple[Bridge, ...]:
    """Every crossing, in the order of the spec. With one island there is none."""
    if len(islands) < 2:
        return ()
    home = {host: island.name for island in islands for host in island.hosts}
    published = _published(spec, home, endpoints)
    found = [
        *_commands(spec, home),
        *_heard(home, published, endpoints),
        *_named(spec, published),
    ]
    return tuple(dict.fromkeys(found))


def commanders_host(spec: Spec, by: str) -> str | None:
    """The host on which a commander of `control` (a program, a robot or a host) sits."""
    if by in spec.programs:
        return program_host(spec, spec.programs[by])
    if by in spec.robots:
        return modes.driving_host(spec, by)
    return by if by in spec.hosts else None


def _published(
    spec: Spec, home: Mapping[str, str], endpoints: Sequence[Endpoint]
) -> dict[str, tuple[str, str]]:
    """Type and island by topic: what drivers and programs publish."""
    found: dict[str, tuple[str, str]] = {}
    for robot in spec.robots:
        island = home.get(modes.driving_host(spec, robot) or "")
        if island is not None:
            prefix = names.namespace(robot)
            found.update((f"{prefix}/{name}", (kind, island)) for name, kind in SENSORS.items())
    for one in endpoints:
        if one.publishes and one.host in home:
            found.setdefault(one.topic, (one.type, home[one.host]))
    return found


def _commands(spec: Spec, home: Mapping[str, str]) -> Iterator[Bridge]:
    for index, control in enumerate(spec.control):
        origin = home.get(commanders_host(spec, control.by) or "")
        for robot in control.of:
            to = home.get(modes.driving_host(spec, robot) or "") if robot in spec.robots else None
            if origin is not None and to is not None and origin != to:
                topic = f"{names.namespace(robot)}/{COMMAND}"
                yield Bridge(topic, COMMAND_TYPE, origin, (to,), f"control[{index}]")


def _heard(
    home: Mapping[str, str], published: Mapping[str, tuple[str, str]], endpoints: Sequence[Endpoint]
) -> Iterator[Bridge]:
    for one in endpoints:
        if one.publishes or one.host not in home or one.topic not in published:
            continue
        kind, origin = published[one.topic]
        if origin != home[one.host]:
            yield Bridge(one.topic, kind, origin, (home[one.host],), f"programs.{one.owner}")


def _named(spec: Spec, published: Mapping[str, tuple[str, str]]) -> Iterator[Bridge]:
    named = spec.multimaster.topics if spec.multimaster else ()
    for index, crossing in enumerate(named):
        if crossing.topic in published:
            kind, origin = published[crossing.topic]
            to = tuple(one for one in crossing.to if one != origin)
            yield Bridge(crossing.topic, kind, origin, to, f"multimaster.topics[{index}]")
