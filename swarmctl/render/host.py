"""One host's bundle: the ROS part, and what the operating system must know of it."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.render import bluetooth, firmware, multimaster, programs, ros1
from swarmctl.render.bundle import Bundle, File, Unit
from swarmctl.render.prepare import Part, Preparation
from swarmctl.render.templates import render
from swarmctl.topology import names
from swarmctl.topology.swarm import Host, Island, Swarm

_SYSTEMD = "/etc/systemd/system"


def bundles(swarm: Swarm) -> Mapping[str, Bundle]:
    """The bundle of every host, in the order of the spec; an empty one where nothing of the swarm runs."""
    members = {name for island in swarm.islands for name in island.hosts}
    preparation = Preparation(swarm)
    return {
        name: _bundle(swarm, host, tuple(preparation.parts(host)))
        if name in members
        else Bundle(swarm.name, name, ())
        for name, host in swarm.hosts.items()
    }


def _bundle(swarm: Swarm, host: Host, parts: tuple[Part, ...]) -> Bundle:
    """Everything that ``host`` gets: its ROS, and the ``parts`` of its preparation."""
    island = swarm.island_of(host.name)
    unit_files = [
        *(part.unit for part in parts if part.unit),
        *bluetooth.units(swarm, host),
        *ros1.units(swarm, host, island),
        *multimaster.units(swarm, host, island),
        *programs.units(swarm, host),
    ]
    target = names.target(swarm.name)
    files = [
        *bluetooth.files(swarm, host),
        *ros1.files(swarm, host, island),
        *multimaster.files(swarm, host, island),
        *programs.files(swarm, host),
        *(file for file, _ in unit_files),
        *(file for part in parts for file in part.files),
    ]
    files.append(_target_file(swarm, target, [unit for _, unit in unit_files]))
    links = {f"{_SYSTEMD}/{unit.name}": file.path for file, unit in unit_files}
    links[f"{_SYSTEMD}/{target}"] = f"units/{target}"
    links[f"{_SYSTEMD}/multi-user.target.wants/{target}"] = f"units/{target}"
    links |= {path: inside for part in parts for path, inside in part.links.items()}
    return Bundle(
        swarm=swarm.name,
        host=host.name,
        files=tuple(sorted(dict.fromkeys(files), key=lambda file: file.path)),
        units=(*(unit for _, unit in unit_files), Unit(target, ())),
        links=links,
        blocks={path: inside for part in parts for path, inside in part.blocks.items()},
        requires=_requires(swarm, host, island),
        wants=(
            *(name for part in parts for name in part.wants),
            *bluetooth.wants(swarm, host),
            *firmware.wants(swarm, host),
        ),
        follows=next((part.follows for part in parts if part.follows), ""),
        secrets=bluetooth.secrets(swarm, host),
    )


def _requires(swarm: Swarm, host: Host, island: Island) -> tuple[str, ...]:
    found = (
        *ros1.requires(swarm, host, island),
        *multimaster.requires(swarm, host, island),
        *programs.requires(swarm, host),
    )
    return tuple(dict.fromkeys(found))


def _target_file(swarm: Swarm, target: str, units: list[Unit]) -> File:
    return File(
        f"units/{target}",
        render("swarm.target", swarm=swarm.name, units=[unit.name for unit in units]),
        origin="robots",
    )
