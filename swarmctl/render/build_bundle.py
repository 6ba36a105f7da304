"""The bundle of every host, put together from the parts that ROS, multimaster and operating system add."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from itertools import chain
from typing import Any

from swarmctl.render import bluetooth, service_values
from swarmctl.render.bundle import Bundle, File, Part, Unit
from swarmctl.render.host_os import Preparation
from swarmctl.render.middleware import middleware_at
from swarmctl.render.multimaster import MultimasterProvider, running_on
from swarmctl.render.quoting import render
from swarmctl.render.security_level import level_of
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Swarm
from swarmctl.yamltext.source import collector_paused

_SYSTEMD = "/etc/systemd/system"


def bundles(swarm: Swarm) -> Mapping[str, Bundle]:
    """Returns the bundle of every host, in the order of the spec; empty for a host that runs nothing."""
    members = {name for island in swarm.islands for name in island.hosts}
    preparation = Preparation(swarm)
    running = running_on(swarm.multimaster, swarm.islands, swarm.carriers)
    with collector_paused():
        return {
            name: _bundle(swarm, host, (*preparation.parts(host), *_swarm_parts(swarm, host, running)))
            if name in members
            else Bundle(swarm=swarm.name, host=name, distro=swarm.distro_of(name))
            for name, host in swarm.hosts.items()
        }


def _swarm_parts(swarm: Swarm, host: Host, running: Mapping[str, MultimasterProvider]) -> Iterator[Part]:
    """The levels of security, robots, multimaster and programs, in the start order of their units."""
    island, middleware = swarm.island_of(host.name), middleware_at(swarm, host.name)
    yield from level_of(island.security).parts(swarm, host)
    yield from level_of(swarm.security).swarm_parts(swarm, host)
    yield from bluetooth.parts(swarm, host)
    yield from middleware.robots(swarm, host, island)
    yield service_values.maintenance_part(swarm, host)
    if host.name == island.hub and island.name in running:
        yield from running[island.name].parts(swarm, host, island)
    yield from middleware.programs(swarm, host)
    yield Part(files=tuple(middleware.launch_files(swarm, host, island)))


def _bundle(swarm: Swarm, host: Host, parts: tuple[Part, ...]) -> Bundle:
    """The bundle of ``host``: its ``parts``, and a systemd target that starts their units."""
    target = names.target(swarm.name)
    units = [unit.name for part in parts for unit in part.units]
    links = {f"{_SYSTEMD}/{unit}": f"units/{unit}" for unit in (*units, target)}
    links[f"{_SYSTEMD}/multi-user.target.wants/{target}"] = f"units/{target}"
    last = Part((_target_file(swarm, target, units),), (Unit(target, ()),))
    every = (Part(links=links), *parts, last)
    joined = {one.name: _joined([getattr(part, one.name) for part in every]) for one in fields(Part)}
    joined["files"] = tuple(sorted(joined["files"], key=lambda file: file.path))
    return Bundle(**joined, swarm=swarm.name, host=host.name, distro=swarm.distro_of(host.name))


def _joined(values: Sequence[Any]) -> Any:
    """What several parts have in one field: everything, or the first text that is not empty."""
    if isinstance(values[0], str):
        return next(filter(None, values), "")
    if isinstance(values[0], tuple):
        return tuple(dict.fromkeys(chain(*values)))
    found: dict[str, Any] = {}
    for key, value in chain(*(one.items() for one in values)):
        found[key] = _joined([found[key], value]) if key in found else value
    return found


def _target_file(swarm: Swarm, target: str, units: list[str]) -> File:
    return File(
        f"units/{target}",
        render("swarm.target", swarm=swarm.name, units=units),
        origin="robots",
    )
