"""One host's bundle: the ROS part, and what the operating system must know of it."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.render import multimaster, programs, ros1
from swarmctl.render.bundle import Bundle, File, Unit
from swarmctl.render.templates import render
from swarmctl.topology import names
from swarmctl.topology.address import ip_of
from swarmctl.topology.swarm import Host, Island, Swarm, UsbLine

_SYSTEMD = "/etc/systemd/system"
_UDEV = "/etc/udev/rules.d"


def bundles(swarm: Swarm) -> Mapping[str, Bundle]:
    """The bundle of every host, in the order of the spec; an empty one where nothing of the swarm runs."""
    members = {name for island in swarm.islands for name in island.hosts}
    shared = _hosts_block(swarm)
    return {
        name: _bundle(swarm, host, shared) if name in members else Bundle(swarm.name, name, ())
        for name, host in swarm.hosts.items()
    }


def _bundle(swarm: Swarm, host: Host, hosts_block: File) -> Bundle:
    """Everything that ``host`` gets, with what is the same for all."""
    island = swarm.island_of(host.name)
    unit_files = [
        *ros1.units(swarm, host, island),
        *multimaster.units(swarm, host, island),
        *programs.units(swarm, host),
    ]
    target = names.target(swarm.name)
    files = [
        *ros1.files(swarm, host, island),
        *multimaster.files(swarm, host, island),
        *programs.files(swarm, host),
        *(file for file, _ in unit_files),
    ]
    files.append(_target_file(swarm, target, [unit for _, unit in unit_files]))
    links = {f"{_SYSTEMD}/{unit.name}": file.path for file, unit in unit_files}
    links[f"{_SYSTEMD}/{target}"] = f"units/{target}"
    links[f"{_SYSTEMD}/multi-user.target.wants/{target}"] = f"units/{target}"
    if rules := _udev_rules(swarm, host):
        files.append(rules)
        links[f"{_UDEV}/60-swarm-{swarm.name}.rules"] = rules.path
    files.append(hosts_block)
    return Bundle(
        swarm=swarm.name,
        host=host.name,
        files=tuple(sorted(files, key=lambda file: file.path)),
        units=(*(unit for _, unit in unit_files), Unit(target, ())),
        links=links,
        blocks={"/etc/hosts": "hosts/block"},
        requires=_requires(swarm, host, island),
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


def _udev_rules(swarm: Swarm, host: Host) -> File | None:
    lines = [
        {
            "robot": robot.name,
            "serial": robot.line.usb.serial,
            "vendor": robot.line.usb.vendor,
            "product": robot.line.usb.product,
        }
        for robot in swarm.robots_on(host.name)
        if isinstance(robot.line, UsbLine)
    ]
    return File("udev/swarm.rules", render("swarm.rules", lines=lines), origin="links") if lines else None


def _hosts_block(swarm: Swarm) -> File:
    """The other hosts' names, for people and for programs that use them; ROS itself goes by address."""
    known = [host for host in swarm.hosts.values() if ip_of(host.address)]
    return File("hosts/block", render("block.hosts", hosts=known), origin="hosts")
