"""What the hub of an island needs to meet the other masters: its provider's files, a unit, packages."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.render import fkie, ros1
from swarmctl.render.bundle import File, Unit
from swarmctl.render.templates import render
from swarmctl.topology import names
from swarmctl.topology.swarm import Host, Island, Swarm


def joins(swarm: Swarm, host: Host, island: Island) -> bool:
    """Whether this host joins its island's master to others."""
    return len(swarm.islands) > 1 and host.name == island.hub and swarm.multimaster.provider == "fkie"


def files(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """Every file that meeting the others needs, the unit aside."""
    if joins(swarm, host, island):
        yield from fkie.files(swarm, island)


def units(swarm: Swarm, host: Host, island: Island) -> Iterator[tuple[File, Unit]]:
    """The unit beside this hub's master: it starts after it and restarts with it."""
    if not joins(swarm, host, island):
        return
    name = names.unit(swarm.name, names.MULTIMASTER)
    text = render(
        "multimaster.service",
        **ros1.service_values(swarm),
        master=names.unit(swarm.name, names.MASTER),
        command=fkie.command(swarm),
        runtime=names.runtime_folder(swarm.name, names.MULTIMASTER),
    )
    file = File(f"units/{name}", text, origin="multimaster")
    own = tuple(one.path for one in files(swarm, host, island))
    yield file, Unit(name, (file.path, *ros1.RUNNING, *own))


def requires(swarm: Swarm, host: Host, island: Island) -> tuple[str, ...]:
    """What must be installed on this host already."""
    return fkie.requires(swarm, island) if joins(swarm, host, island) else ()
