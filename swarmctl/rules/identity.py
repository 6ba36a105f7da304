"""Devices, addresses of robots and names that must be unique."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Callable, Collection, Hashable, Iterator
from functools import partial
from typing import Any

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.links.radio_link import Radio
from swarmctl.links.serial_link import Serial, Usb
from swarmctl.linter.context import RuleContext, rule
from swarmctl.rules.devices import FACTORY, INTERFACE
from swarmctl.rules.opened_devices import Opened, opened_twice
from swarmctl.spec.references import rename, renaming
from swarmctl.swarm import names
from swarmctl.swarm.addresses import IpEnds, Subnet, normal
from swarmctl.yamltext.edits import make_fix, replace_value

_LOCALHOST = "localhost"
_BY_ID = re.compile(r"/dev/serial/by-id/usb-.*_([A-Za-z0-9]{8,})-if([0-9a-f]{2})(?:-port[0-9]+)?")
_MODELS = 50  # adapters of one serial number that are compared: nobody has so many models of them
_PINS = ("/dev/serial0", "/dev/ttyAMA0", "/dev/ttyS0")
_ONE_UART = ("raspberry-pi-2", "raspberry-pi-3", "raspberry-pi-4", "raspberry-pi-zero")

_NAMELESS = Usb.model_construct()

Place = tuple[Any, ...]
Claim = tuple[Hashable, str, Place]  # the value, its owner, and its place in the spec


@rule("ID002")
def duplicate_devices(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots, or a robot and a program, of one host on one device or USB adapter."""
    of_adapters: list[tuple[Hashable, int]] = []  # with the index of the link
    of_devices: list[tuple[Hashable, int]] = []
    adapters: dict[tuple[str, str], list[Usb]] = {}
    lines = [(index, link) for index, link in context.lines if isinstance(link, Serial)]
    for index, link in lines:
        if (usb := link.usb) is not None:
            adapter = (link.host, usb.identity)
            named = adapters.setdefault(adapter, [])
            if len(named) >= _MODELS:
                continue
            port = _port_among(named, usb) if named else 0
            if port == len(named):
                named.append(usb)
            of_adapters.append(((adapter, port), index))
    for index, link in lines:
        if link.usb is None and link.device is not None:
            usb = _usb_in(link.device)
            adapter = (link.host, usb.identity)
            named = adapters.get(adapter, [])
            port = _port_among(named, usb)
            if port < len(named):
                of_adapters.append(((adapter, port), index))
            else:
                of_devices.append(((link.host, _path(context, link)), index))
    own = "each robot needs its own serial link"
    yield from duplicates(context, "ID002", "serial device", _repeated(context, of_devices), own)
    help_ = f"{own}; ports of one adapter differ in `interface` {INTERFACE}"
    yield from duplicates(context, "ID002", "serial device", _repeated(context, of_adapters), help_)
    yield from opened_twice(context, _of_lines(context))


def _repeated(context: RuleContext, used: list[tuple[Hashable, int]]) -> list[Claim]:
    """Returns what several links use, each with the index of its link."""
    count = Counter(value for value, _ in used)
    links = {index: (value, context.spec.links[index]) for value, index in used if count[value] > 1}
    return [
        (value, f"robot `{link.robot}`", ("links", index, *_place(link)))
        for index, (value, link) in links.items()
        if isinstance(link, Serial)
    ]


def _of_lines(context: RuleContext) -> Iterator[Opened]:
    for index, link in context.lines:
        device = link.device_of(0, 1, "") if isinstance(link, Serial) else None
        if isinstance(link, Serial) and device is not None:
            path = posixpath.normpath(device.path)
            place = partial(context.span, "links", index, *_place(link))
            yield Opened(link.host, path, f"robot `{link.robot}`", place)


def _usb_in(device: str) -> Usb:
    """Returns the serial number and interface in a path of /dev/serial/by-id; none of both if it has none."""
    found = _BY_ID.fullmatch(device)
    if found is None or not any(char.isdigit() for char in found[1]):
        return _NAMELESS
    return Usb.model_construct(serial=found[1], interface=int(found[2], 16))


def _path(context: RuleContext, link: Serial) -> str:
    """Returns a device's path; the pins of a Raspberry Pi have one UART, which has several names."""
    computer = context.computer_of(link.host) or "" if link.host in context.spec.hosts else ""
    on_pins = link.device in _PINS and computer.startswith(_ONE_UART)
    return _PINS[0] if on_pins else posixpath.normpath(link.device or "")


@rule("ID007")
def adapters_of_two_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """One USB adapter at two hosts."""
    first: dict[str, list[tuple[int, Serial, Usb]]] = {}
    for index, link in context.lines:
        if not isinstance(link, Serial) or (link.usb is None and link.device is None):
            continue
        usb = link.usb or _usb_in(link.device or "")
        if usb.path or not usb.serial or FACTORY.fullmatch(usb.serial):
            continue
        earlier = first.setdefault(usb.serial, [])
        if len(earlier) >= _MODELS:
            continue
        same = next((one for one in earlier if _may_be_one(one[2], usb)), None)
        if same is None:
            earlier.append((index, link, usb))
        elif same[1].host != link.host:
            yield Diagnostic(
                "ID007",
                f"robots `{same[1].robot}` and `{link.robot}` have the same USB adapter, on two hosts",
                context.span("links", index, *_place(link)),
                label=f"on host `{link.host}`",
                notes=(Note(context.span("links", same[0], *_place(same[1])), f"on host `{same[1].host}`"),),
                help=(
                    "write the serial number of the adapter at this host; `udevadm info -a` shows it there",
                    "if two adapters share it, add `vendor` and `product`, or ignore this with a reason",
                ),
            )


def _place(link: Serial) -> tuple[str, ...]:
    if link.usb is None:
        return ("device",)
    return ("usb", "path" if link.usb.path else "serial")


def _may_be_one(first: Usb, second: Usb) -> bool:
    """True if one udev rule could match both adapters; cheap ones differ only in their ids."""
    return _agree((first.vendor, second.vendor), (first.product, second.product))


def _port_among(named: list[Usb], usb: Usb) -> int:
    """Returns the place of the first port that one udev rule could match, too; the end without one."""
    same = (
        place
        for place, one in enumerate(named)
        if _may_be_one(one, usb) and _agree((one.interface, usb.interface))
    )
    return next(same, len(named))


def _agree(*pairs: tuple[object, object]) -> bool:
    return all(one is None or other is None or one == other for one, other in pairs)


@rule("ID003")
def duplicate_bluetooth(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots with one Bluetooth address."""
    claims: list[Claim] = [
        (link.mac, f"robot `{link.robot}`", ("links", index, "mac"))
        for index, link in enumerate(context.spec.links)
        if isinstance(link, Bluetooth)
    ]
    yield from duplicates(
        context,
        "ID003",
        "Bluetooth address",
        claims,
        "each robot has its own address; its label or `bluetoothctl scan on` shows it",
    )


@rule("ID008")
def duplicate_robot_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """Two robots with one address and port, as one host or one network reaches them.

    Robots that are their own access points have one address by default; each needs a host of its own.
    """
    claims: list[Claim] = [
        (
            (ends.link.kind, normal(ends.link.address), ends.port, _seen_from(ends)),
            f"robot `{ends.link.robot}`",
            ("links", index, "address"),
        )
        for index, ends in context.ip_links.items()
    ]
    help_ = "each robot needs its own address; one that is its own access point needs a host of its own"
    yield from duplicates(context, "ID008", "address and port", claims, help_)


def _seen_from(ends: IpEnds) -> str:
    """Where an address means one robot: in a network of the spec, else at the host alone."""
    return f"network {ends.network.name}" if ends.network is not None else f"host {ends.link.host}"


@rule("ID009")
def duplicate_radio_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """Two Crazyflies with one address on one channel: each obeys the commands for both."""
    claims: list[Claim] = [
        ((link.channel, link.address), f"robot `{link.robot}`", ("links", index, "uri"))
        for index, link in context.lines
        if isinstance(link, Radio)
    ]
    help_ = "give each Crazyflie its own address, with the Crazyflie client over USB, or another channel"
    yield from duplicates(context, "ID009", "radio address and channel", claims, help_)


@rule("ID004")
def duplicate_networks(context: RuleContext) -> Iterator[Diagnostic]:
    """Two networks with one name."""
    claims: list[Claim] = [
        (link.name, f"entry {index + 1} of `links`", ("links", index, "name"))
        for index, link in context.networks
    ]
    networks = dict(context.networks)
    taken = {link.name for link in networks.values()}

    def renamed(loc: Place) -> Fix | None:
        if any(_overlap(context.subnets[loc[1]], context.subnets[one]) for one in networks if one != loc[1]):
            return None  # they may be the same network
        name = _free(networks[loc[1]].name, taken)
        taken.add(name)
        return make_fix(f"rename it to `{name}`", replace_value(context.source, loc, name), safe=False)

    yield from duplicates(context, "ID004", "network name", claims, "rename one of them", fix=renamed)


def _overlap(one: Subnet | None, other: Subnet | None) -> bool:
    return one is not None and other is not None and one.version == other.version and one.overlaps(other)


def _free(name: str, taken: Collection[str]) -> str:
    """Returns the name, with the first number that makes it unique if needed; at most 31 characters."""
    tries = (name, *(f"{name[:27]}-{number}" for number in range(2, 1000)))
    return next((one for one in tries if one not in taken), name)


def duplicates(
    context: RuleContext,
    code: str,
    what: str,
    claims: list[Claim],
    help_: str,
    *,
    fix: Callable[[Place], Fix | None] = lambda _: None,
) -> Iterator[Diagnostic]:
    """Yields a finding of the rule ``code`` for each value that an earlier one claims already."""
    first: dict[Hashable, tuple[str, Place]] = {}
    for claimed, owner, loc in claims:
        if claimed not in first:
            first[claimed] = (owner, loc)
            continue
        earlier, place = first[claimed]
        yield Diagnostic(
            code,
            f"{earlier} and {owner} have the same {what}",
            context.span(*loc),
            label=f"used by {owner}",
            notes=(Note(context.span(*place), f"first used by {earlier}"),),
            help=(help_,),
            fix=fix(loc),
        )


@rule("ID006")
def reserved_names(context: RuleContext) -> Iterator[Diagnostic]:
    """Reserved names. Robots and programs become units next to the master's; hosts go into /etc/hosts."""
    if _LOCALHOST in context.spec.hosts:
        yield Diagnostic(
            "ID006",
            f"`{_LOCALHOST}` is reserved: it means the local computer on every host",
            context.span("hosts", _LOCALHOST, key=True),
            help=("choose another name; it is written into /etc/hosts",),
            fix=_renamed(context, "hosts", _LOCALHOST, f"{context.spec.name}-host"),
        )
    for kind in ("robots", "programs"):
        for part, what in names.TAKEN.items():
            if part in getattr(context.spec, kind):
                yield Diagnostic(
                    "ID006",
                    f"`{part}` is reserved: it is the name of {what}",
                    context.span(kind, part, key=True),
                    help=("choose another name",),
                    fix=_renamed(context, kind, part, f"{context.spec.name}-{part}"),
                )
    for name in context.spec.programs:
        if name in context.spec.robots:
            yield Diagnostic(
                "ID006",
                f"a robot and a program have the same name, `{name}`",
                context.span("programs", name, key=True),
                notes=(Note(context.span("robots", name, key=True), "the robot"),),
                help=("rename the program",),
                fix=_renamed(context, "programs", name, f"{name}-program"),
            )


def _renamed(context: RuleContext, kind: str, old: str, new: str) -> Fix | None:
    """Returns the fix that renames it everywhere to a name that no host, robot or program has."""
    spec = context.spec
    name = _free(new[:31], {*spec.hosts, *spec.robots, *spec.programs})
    return renaming(old, name, rename(context.source, kind, old, name), safe=False)
