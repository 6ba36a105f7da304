"""Which topics are bridged between islands: those that `control`, programs and `multimaster.topics` need."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.plugins import MIDDLEWARES, MULTIMASTERS
from swarmctl.spec.ros_model import Multimaster
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolved import Bridge
from swarmctl.swarm.topic_origins import Publishers


def provider_name(settings: Multimaster | None, distro: str) -> str:
    """Returns the provider that ``settings`` name if it joins islands of ``distro``, else that of the
    middleware; empty if it has none."""
    named = settings and settings.provider
    return named if named and joins(named, distro) else MIDDLEWARES.get(distro).multimaster


def joins(provider: str, distro: str) -> bool:
    """Returns True if ``provider`` joins islands of ``distro``."""
    needs = MULTIMASTERS.get(provider).needs
    return needs is None or needs in MIDDLEWARES.get(distro).capabilities


def bridges_of(index: SwarmIndex) -> tuple[Bridge, ...]:
    """Returns every bridge, in the order of the spec; empty with fewer than two islands."""
    if len(index.islands) < 2:
        return ()
    publishers = Publishers(index)
    found = [*_commands(index), *_subscribed(index, publishers), *_declared(index, publishers)]
    return tuple(dict.fromkeys(found))


def _commands(index: SwarmIndex) -> Iterator[Bridge]:
    """The commands that `control` allows from one island to another."""
    for number, control in enumerate(index.spec.control):
        origin = index.home.get(index.commander_host(control.by) or "")
        for robot in control.of:
            to = index.island_of_robot(robot) if robot in index.spec.robots else None
            command = index.command_topics.get(robot)
            if origin is not None and to is not None and origin is not to and command is not None:
                yield Bridge(command.topic, command.type, origin.name, (to.name,), f"control[{number}]")


def _subscribed(index: SwarmIndex, publishers: Publishers) -> Iterator[Bridge]:
    """What a program subscribes to and its own island does not publish, from every island that does."""
    for one in index.endpoints:
        if one.publishes or one.host not in index.home:
            continue
        to = index.home[one.host].name
        origins = publishers.of(one.topic)
        if to not in origins:
            for origin, kind in origins.items():
                yield Bridge(one.topic, kind, origin, (to,), f"programs.{one.owner}")


def _declared(index: SwarmIndex, publishers: Publishers) -> Iterator[Bridge]:
    """The topics in `multimaster.topics`, from every island that publishes them."""
    islands = {island.name for island in index.islands}
    multimaster = index.spec.multimaster
    for number, declared in enumerate(multimaster.topics if multimaster else ()):
        for origin, kind in publishers.of(declared.topic).items():
            to = tuple(one for one in declared.to if one != origin and one in islands)
            if to:
                yield Bridge(declared.topic, kind, origin, to, f"multimaster.topics[{number}]")
