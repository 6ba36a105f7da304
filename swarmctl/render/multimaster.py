"""What the hub of an island needs to meet the other masters: its provider's files, a unit, packages."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.render import fkie, ros1, static
from swarmctl.render.bundle import File, Unit
from swarmctl.render.templates import render
from swarmctl.topology import names
from swarmctl.topology.swarm import Host, Island, Swarm


def joins(swarm: Swarm, host: Host, island: Island) -> bool:
    """Whether this host joins its island's master to others."""
    return len(swarm.islands) > 1 and host.name == island.hub


def files(swarm: Swarm, host: Host, island: Island) -> Iterator[File]:
    """Every file that meeting the others needs, the unit aside."""
    if not joins(swarm, host, island):
        return
    if swarm.multimaster.provider == "static":
        yield from static.files(swarm, host, island)
    else:
        yield ros1.ros_client()
        yield from fkie.files(swarm, island)


def units(swarm: Swarm, host: Host, island: Island) -> Iterator[tuple[File, Unit]]:
    """The unit beside this hub's master, if there is anything to do for one."""
    if not joins(swarm, host, island):
        return
    if swarm.multimaster.provider == "fkie":
        yield _fkie_unit(swarm, host, island)
    elif (found := static.unit(swarm, host, island)) is not None:
        yield found


def _fkie_unit(swarm: Swarm, host: Host, island: Island) -> tuple[File, Unit]:
    """It waits for the master and starts anew with it."""
    name = names.unit(swarm.name, names.MULTIMASTER)
    text = render(
        "multimaster.service",
        **ros1.service_values(swarm),
        command=fkie.command(swarm),
        runtime=names.runtime_folder(swarm.name, names.MULTIMASTER),
    )
    file = File(f"units/{name}", text, origin="multimaster")
    own = tuple(one.path for one in files(swarm, host, island))
    return file, Unit(name, (file.path, *ros1.RUNNING, *own))


def requires(swarm: Swarm, host: Host, island: Island) -> tuple[str, ...]:
    """What must be installed on this host already; our own node needs what a master needs."""
    if swarm.multimaster.provider == "static" or not joins(swarm, host, island):
        return ()
    return fkie.requires(swarm, island)
