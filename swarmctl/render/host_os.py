"""The preparation of a host's operating system: host names, clock, device names, wlan power saving.

docs/hosts.md describes what each part changes on a host, and how to undo it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property

from swarmctl.links.bluetooth_link import RfcommLine
from swarmctl.links.radio_link import Radio
from swarmctl.links.serial_link import Usb, UsbLine
from swarmctl.plugins import LINK_KINDS
from swarmctl.render import shipped_files
from swarmctl.render.bundle import ROOT, File, Part, Unit
from swarmctl.render.quoting import render
from swarmctl.swarm import names
from swarmctl.swarm.addresses import ip_of, subnet_of
from swarmctl.swarm.clocks import followed
from swarmctl.swarm.resolved import Host, Robot, Swarm

HOSTS = "/etc/hosts"
CHRONY = "/etc/chrony/chrony.conf"
_SYSTEMD = "/etc/systemd/system"
_UDEV = "/etc/udev/rules.d"
_NETWORK_MANAGER = "/etc/NetworkManager/conf.d"
_AWAKE = "bin/wlan-awake"


class Preparation:
    """The preparation of every host of one swarm; what all of them share is made once."""

    def __init__(self, swarm: Swarm) -> None:
        self._swarm = swarm
        self._followed = followed(swarm)
        self._followers: dict[str, list[Host]] = {}
        for host, root in self._followed.items():
            self._followers.setdefault(root, []).append(swarm.hosts[host])
        wireless = (one for one in swarm.networks if LINK_KINDS.get(one.kind).wireless)
        self._wireless = {host for one in wireless for host in one.hosts}

    def parts(self, host: Host) -> Iterator[Part]:
        """Yields what ``host`` gets, kind by kind."""
        yield self._names
        if host.name in self._followed:
            yield self._follower(host)
        elif host.name in self._followers:
            yield self._root(host)
        if host.name in self._wireless:
            yield self._awake
        yield from self._devices(host)

    @cached_property
    def _names(self) -> Part:
        """The names of all hosts, for people and for programs that use them."""
        known = [host for host in self._swarm.hosts.values() if ip_of(host.ros_address)]
        file = File("hosts/block", render("block.hosts", hosts=known), origin="hosts")
        return Part((file,), blocks={HOSTS: file.path})

    def _follower(self, host: Host) -> Part:
        root = self._swarm.hosts[self._followed[host.name]]
        allowed = self._robots_behind(host)
        part = _clock(render("follower.chrony", root=root.address, name=root.name, allowed=allowed))
        return replace(part, follows=root.name, by_hand=self._time_of_robots(host))

    def _root(self, host: Host) -> Part:
        """A server for those who follow: their networks as far as known, else each by its address."""
        followers = self._followers[host.name]
        subnets = [one.subnet for one in self._swarm.networks if one.subnet and host.name in one.hosts]
        known = [subnet_of(subnet) for subnet in subnets]
        addresses = [(one.address, ip_of(one.address)) for one in followers]
        outside = [text for text, ip in addresses if ip and not any(ip in subnet for subnet in known)]
        # chronyd ends when it cannot resolve a name that it is to allow.
        anyone = not subnets and any(ip is None for _, ip in addresses)
        text = render(
            "root.chrony",
            servers=self._swarm.time.servers,
            allowed=[] if anyone else [*dict.fromkeys(subnets), *outside, *self._robots_behind(host)],
            anyone=anyone,
        )
        return replace(_clock(text), by_hand=self._time_of_robots(host))

    def _robots_behind(self, host: Host) -> Mapping[str, Robot]:
        """The robots that reach ``host`` alone, and have a clock of their own, by their addresses."""
        robots = (one for one in self._swarm.robots_on(host.name) if one.host_address is not None)
        return {one.node_address: one for one in robots if one.node_address and ip_of(one.node_address)}

    def _time_of_robots(self, host: Host) -> tuple[str, ...]:
        return tuple(
            f"robot {one.name} ({address}) has a clock of its own; set its time server to {one.host_address}"
            for address, one in self._robots_behind(host).items()
        )

    @cached_property
    def _awake(self) -> Part:
        """Wireless power saving off: for NetworkManager by its settings, for all others at boot."""
        swarm = self._swarm
        settings = File("network/wlan.conf", render("wlan.conf", section=f"connection-swarm-{swarm.name}"))
        name = names.unit(swarm.name, names.WLAN)
        file = File(
            f"units/{name}",
            render(
                "wlan.service", swarm=swarm.name, target=names.target(swarm.name),
                home=f"{ROOT}/{swarm.name}", runtime=names.runtime_folder(swarm.name, names.WLAN),
            ),
            origin="links",
        )  # fmt: skip
        return Part(
            (settings, file, File(_AWAKE, shipped_files.text("os/wlan-awake"), 0o755)),
            (Unit(name, (file.path, _AWAKE)),),
            links={f"{_NETWORK_MANAGER}/swarm-{swarm.name}.conf": settings.path},
            wants={"iw": ("links",)},
        )

    def _devices(self, host: Host) -> Iterator[Part]:
        """The names of adapters, and who has to keep off them. brltty's own rules have number 85."""
        robots = self._swarm.robots_on(host.name)
        adapters = [(robot.name, robot.line.usb) for robot in robots if isinstance(robot.line, UsbLine)]
        bound = [robot.line.index for robot in robots if isinstance(robot.line, RfcommLine)]
        lines = [_adapter(robot, usb) for robot, usb in adapters]
        radios = any(isinstance(robot.link, Radio) for robot in robots)
        found = {
            "60": render("swarm.rules", lines=lines, bound=bound, radios=radios)
            if lines or bound or radios
            else b"",
            "90": render("guard.rules", lines=lines) if lines else b"",
        }
        for number, text in found.items():
            if text:
                file = File(f"udev/{number}-swarm.rules", text, origin="links")
                yield Part((file,), links={f"{_UDEV}/{number}-swarm-{self._swarm.name}.rules": file.path})


def _clock(text: bytes) -> Part:
    file = File("chrony/block", text, origin="time")
    return Part((file,), blocks={CHRONY: file.path}, wants={"chronyd": ("time",)})


def _adapter(robot: str, usb: Usb) -> dict[str, object]:
    """A robot's adapter, and what udev knows it by: the port and attributes of one USB device."""
    known = {"serial": usb.serial, "idVendor": usb.vendor, "idProduct": usb.product}
    return {
        "robot": robot,
        "port": usb.path,
        "interface": None if usb.interface is None else f"{usb.interface:02x}",
        "identity": [(key, value) for key, value in known.items() if value],
    }
