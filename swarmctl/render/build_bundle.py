"""The bundle of every host, put together from the parts that ROS, multimaster and operating system add."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from swarmctl.render import bluetooth, maintenance_file
from swarmctl.render.bundle import Bundle, File, Unit
from swarmctl.render.host_os import Preparation
from swarmctl.render.middleware import middleware_of
from swarmctl.render.multimaster import provider_of, runs_on
from swarmctl.render.part import Part
from swarmctl.render.quoting import render
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Swarm
from swarmctl.yamltext.source import collector_paused

_SYSTEMD = "/etc/systemd/system"


def bundles(swarm: Swarm) -> Mapping[str, Bundle]:
    """Returns the bundle of every host, in the order of the spec; empty for a host that runs nothing."""
    members = {name for island in swarm.islands for name in island.hosts}
    preparation = Preparation(swarm)
    with collector_paused():
        return {
            name: _bundle(swarm, host, (*preparation.parts(host), *_swarm_parts(swarm, host)))
            if name in members
            else Bundle(swarm.name, name, (), distro=swarm.distro)
            for name, host in swarm.hosts.items()
        }


def _swarm_parts(swarm: Swarm, host: Host) -> Iterator[Part]:
    """The robots, the multimaster and the programs of ``host``, in the start order of their units."""
    island, middleware = swarm.island_of(host.name), middleware_of(swarm.distro)
    provider = provider_of(swarm.multimaster, swarm.distro)
    yield bluetooth.part(swarm, host)
    yield middleware.robots(swarm, host, island)
    yield maintenance_file.part(swarm, host)
    if host.name == island.hub and runs_on(provider, len(swarm.islands), island.name in swarm.received):
        yield provider.part(swarm, host, island)
    yield middleware.programs(swarm, host)
    yield Part(files=tuple(middleware.launch_files(swarm, host, island)))


def _bundle(swarm: Swarm, host: Host, parts: tuple[Part, ...]) -> Bundle:
    """The bundle of ``host``: its ``parts``, and a systemd target that starts their units."""
    unit_files = [one for part in parts for one in part.units]
    target = names.target(swarm.name)
    files = [file for part in parts for file in part.files]
    files += [file for file, _ in unit_files]
    files.append(_target_file(swarm, target, [unit for _, unit in unit_files]))
    links = {f"{_SYSTEMD}/{unit.name}": file.path for file, unit in unit_files}
    links[f"{_SYSTEMD}/{target}"] = f"units/{target}"
    links[f"{_SYSTEMD}/multi-user.target.wants/{target}"] = f"units/{target}"
    links |= {path: inside for part in parts for path, inside in part.links.items()}
    return Bundle(
        swarm=swarm.name,
        host=host.name,
        distro=swarm.distro,
        files=tuple(sorted(dict.fromkeys(files), key=lambda file: file.path)),
        units=(*(unit for _, unit in unit_files), Unit(target, ())),
        links=links,
        blocks={path: inside for part in parts for path, inside in part.blocks.items()},
        requires=tuple(dict.fromkeys(name for part in parts for name in part.requires)),
        wants=tuple(dict.fromkeys(name for part in parts for name in part.wants)),
        needed_by=_needed_by(parts),
        follows=next((part.follows for part in parts if part.follows), ""),
        platform=next((part.platform for part in parts if part.platform), ""),
        unbuilt=tuple(dict.fromkeys(name for part in parts for name in part.unbuilt)),
        secrets=tuple(dict.fromkeys(name for part in parts for name in part.secrets)),
        secret_forms={name: form for part in parts for name, form in part.secret_forms.items()},
    )


def _needed_by(parts: Iterable[Part]) -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for part in parts:
        for requirement, entries in (*part.requires.items(), *part.wants.items()):
            found[requirement] = tuple(dict.fromkeys((*found.get(requirement, ()), *entries)))
    return found


def _target_file(swarm: Swarm, target: str, units: list[Unit]) -> File:
    return File(
        f"units/{target}",
        render("swarm.target", swarm=swarm.name, units=[unit.name for unit in units]),
        origin="robots",
    )
