"""Which topics cross between islands: what `control` and the programs need, and what the spec names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set

from swarmctl.spec.model import Spec
from swarmctl.spec.robot_type import RobotType
from swarmctl.topology import modes, names
from swarmctl.topology.interfaces import COMMAND, COMMAND_TYPE, Endpoint, program_host
from swarmctl.topology.publishers import Publishers
from swarmctl.topology.swarm import Bridge, Island


def bridges_of(
    spec: Spec, types: Mapping[str, RobotType], islands: Sequence[Island], endpoints: Sequence[Endpoint]
) -> tuple[Bridge, ...]:
    """Every crossing, in the order of the spec. With one island there is none."""
    if len(islands) < 2:
        return ()
    home = {host: island.name for island in islands for host in island.hosts}
    publishers = Publishers(spec, types, islands, endpoints)
    found = [
        *_commands(spec, home),
        *_heard(home, publishers, endpoints),
        *_named(spec, {island.name for island in islands}, publishers),
    ]
    return tuple(dict.fromkeys(found))


def commanders_host(spec: Spec, by: str) -> str | None:
    """The host on which a commander of `control` (a program, a robot or a host) sits."""
    if by in spec.programs:
        return program_host(spec, spec.programs[by])
    if by in spec.robots:
        return modes.driving_host(spec, by)
    return by if by in spec.hosts else None


def _commands(spec: Spec, home: Mapping[str, str]) -> Iterator[Bridge]:
    for index, control in enumerate(spec.control):
        origin = home.get(commanders_host(spec, control.by) or "")
        for robot in control.of:
            to = home.get(modes.driving_host(spec, robot) or "") if robot in spec.robots else None
            if origin is not None and to is not None and origin != to:
                topic = f"{names.namespace(robot)}/{COMMAND}"
                yield Bridge(topic, COMMAND_TYPE, origin, (to,), f"control[{index}]")


def _heard(
    home: Mapping[str, str], publishers: Publishers, endpoints: Sequence[Endpoint]
) -> Iterator[Bridge]:
    """What a program hears and its own island does not publish, from every island that does."""
    for one in endpoints:
        if one.publishes or one.host not in home:
            continue
        origins = publishers.of(one.topic)
        if home[one.host] not in origins:
            for origin, kind in origins.items():
                yield Bridge(one.topic, kind, origin, (home[one.host],), f"programs.{one.owner}")


def _named(spec: Spec, islands: Set[str], publishers: Publishers) -> Iterator[Bridge]:
    for index, crossing in enumerate(spec.multimaster.topics if spec.multimaster else ()):
        for origin, kind in publishers.of(crossing.topic).items():
            to = tuple(one for one in crossing.to if one != origin and one in islands)
            if to:
                yield Bridge(crossing.topic, kind, origin, to, f"multimaster.topics[{index}]")
